// Saves the figure of a button as PNG, with two pixels per unit of the drawing, on white.
for (const button of document.querySelectorAll("button[data-png]")) {
  button.addEventListener("click", () => {
    const figure = button.closest("figure");
    const parts = [...figure.querySelectorAll("svg:not(svg svg)")];
    const copy = parts[0].cloneNode();
    const boxes = parts.map(({ viewBox: { baseVal } }) => baseVal);
    const [width, height] = [["x", "width"], ["y", "height"]].map(([at, side]) => Math.max(...boxes.map((box) => box[at] + box[side])));
    copy.setAttribute("viewBox", `0 0 ${width} ${height}`);
    for (const part of parts) copy.append(...part.cloneNode(true).childNodes);
    copy.setAttribute("width", 2 * width);
    copy.setAttribute("height", 2 * height);
    const image = new Image();
    image.onload = () => {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [2 * width, 2 * height];
      const context = canvas.getContext("2d");
      context.fillStyle = "white";
      context.fillRect(0, 0, canvas.width, canvas.height);
      context.drawImage(image, 0, 0);
      canvas.toBlob((blob) => {
        const link = document.createElement("a");
        link.href = URL.createObjectURL(blob);
        link.download = `${button.dataset.png}.png`;
        link.click();
        URL.revokeObjectURL(link.href);
      });
    };
    const text = new XMLSerializer().serializeToString(copy);
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
  });
}
