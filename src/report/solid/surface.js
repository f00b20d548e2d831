// Triangle mesh and its rendering by WebGL.
"use strict";

// Corners are encoded as the distance behind the next new vertex; 255 precedes two bytes.
function corners(text) {
  const code = bytes(text);
  const indices = [];
  let next = 0;
  for (let i = 0; i < code.length; i++) {
    let back = code[i];
    if (back === 255) {
      back = code[i + 1] + 256 * code[i + 2];
      i += 2;
    }
    indices.push(next - back);
    if (back === 0) next++;
  }
  return Uint16Array.from(indices);
}

// Returns positions from the middle of everything, corners of triangles, and normals of vertices:
// the mean of the triangles around each, weighted by area.
function meshOf(coded) {
  const positions = numbers(coded.positions, data.cube);
  const indices = corners(coded.corners);
  const normals = new Float32Array(positions.length);
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((corner) => 3 * indices[i + corner]);
    const [u, v] = [b, c].map((end) => [0, 1, 2].map((axis) => positions[end + axis] - positions[a + axis]));
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (const corner of [a, b, c]) for (let axis = 0; axis < 3; axis++) normals[corner + axis] += normal[axis];
  }
  return { positions, indices, normals };
}

// Maps W to the picture: the rows of `turn` point to the right, up and towards the viewer.
const VERTEX = `
  attribute vec3 position, normal, tint;
  uniform mat3 turn;
  uniform vec3 scale, shift;
  varying vec3 facing, paint;
  void main() {
    facing = turn * normal;
    paint = tint;
    gl_Position = vec4(scale * (turn * position) + shift, 1.0);
  }`;
// The light comes from the viewer, so that no side is dark.
const FRAGMENT = `
  precision mediump float;
  uniform vec3 light;
  uniform float ambient, opacity;
  varying vec3 facing, paint;
  void main() {
    vec3 outward = normalize(gl_FrontFacing ? facing : -facing);
    float bright = mix(ambient, 1.0, max(dot(outward, light), 0.0));
    gl_FragColor = vec4(paint * bright * opacity, opacity);
  }`;

// Returns a renderer of meshes with its own canvas, or null without WebGL.
function painter(redraw) {
  const sheet = document.createElement("canvas");
  const gl = sheet.getContext("webgl");
  if (!gl) return null;
  let program, buffers;

  function start() {
    program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    buffers = ["position", "normal", "tint", "corners"].map(() => gl.createBuffer());
  }
  start();
  // After sleep or under load the browser may take the context away for a while.
  sheet.addEventListener("webglcontextlost", (event) => event.preventDefault());
  sheet.addEventListener("webglcontextrestored", () => {
    start();
    redraw();
  });

  function load({ positions, normals, indices }, tints) {
    [[positions, gl.FLOAT], [normals, gl.FLOAT], [tints, gl.UNSIGNED_BYTE]].forEach(([values, kind], i) => {
      const place = gl.getAttribLocation(program, ["position", "normal", "tint"][i]);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[i]);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STREAM_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, kind, kind === gl.UNSIGNED_BYTE, 0, 0);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[3]);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STREAM_DRAW);
    return () => gl.drawElements(gl.TRIANGLES, indices.length, gl.UNSIGNED_SHORT, 0);
  }

  // `view`: width and height in pixels, turn by columns, scale and shift to −1 … 1, light and
  // its ambient fraction. An overlaid mesh is drawn where it is in front by `lift` at least.
  function paintAll(view, { mesh, tints }, over) {
    [sheet.width, sheet.height] = [view.width, view.height];
    gl.viewport(0, 0, view.width, view.height);
    // A canvas that keeps its size keeps its picture.
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(program);
    const uniform = (name) => gl.getUniformLocation(program, name);
    gl.uniformMatrix3fv(uniform("turn"), false, view.turn);
    gl.uniform3fv(uniform("scale"), view.scale);
    gl.uniform3fv(uniform("light"), view.light);
    gl.uniform1f(uniform("ambient"), view.ambient);
    gl.uniform3fv(uniform("shift"), view.shift);
    gl.uniform1f(uniform("opacity"), 1);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.disable(gl.BLEND);
    load(mesh, tints)();
    if (!over) return sheet;
    const lay = load(over.mesh, over.tints);
    const [right, up, back] = view.shift;
    gl.uniform3fv(uniform("shift"), [right, up, back + over.lift]);
    gl.uniform1f(uniform("opacity"), over.opacity);
    // Draws the nearest triangles alone: depths first, then colours.
    gl.colorMask(false, false, false, false);
    lay();
    gl.colorMask(true, true, true, true);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    lay();
    return sheet;
  }
  return paintAll;
}
