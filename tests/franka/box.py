"""Control box of a Franka FR3 by franky-sim, with a finger, an object, and what the simulator lacks: an external wrench, reflexes,
and the version in its answer to a connection, which starts at the second byte (libfranka).

    box.py MESH X Y Z MOUNT RADIUS SEED Q1 Q2 Q3 Q4 Q5 Q6 Q7      lengths in metres, joints in radians

The finger is a sphere of RADIUS on the flange's +z axis, MOUNT from the flange to its centre. Prints {"event": "serving"}, then
"moving" and "at_rest" with the time of day. The signal USR1 trips the reflex of a collision.
"""
import json
import signal
import struct
import sys
import time
import xml.etree.ElementTree as ET

import franky_sim.franka_robot_server as franka_robot_server
import franky_sim.franka_server as franka_server
import franky_sim.mujoco_simulator as mujoco_simulator
import franky_sim.simulation_server as simulation_server
import mujoco
import numpy as np
from franky_sim.base_simulator import RobotParameters
from franky_sim.franka_robot_protocol import (
    AutomaticErrorRecoveryCommand,
    AutomaticErrorRecoveryStatus,
    MoveCommand,
    MoveStatus,
    RobotCommand,
    RobotMode,
)
from franky_sim.franka_robot_server import BaseCommand, ControlMode, FrankaRobotServer

# The control box stops the arm after twenty packets lost in a row (Franka Control Interface documentation).
LOST_PACKETS = 20
# Distance from link 7 to the flange (franka_description).
FLANGE_M = 0.107
# Noise of the estimated wrench, so that it does not repeat to the bit: N, and N m about the finger, 10 mm from the skin.
NOISE = np.array([0.05] * 3 + [0.0005] * 3)
# Largest joint speed at rest, rad/s.
REST = 2e-3

mesh, *numbers = sys.argv[1:]
x, y, z, mount, radius, seed, *home = map(float, numbers)
random = np.random.default_rng(int(seed))


# Places of errors in the robot's state (libfranka, research_interface/robot/error.h).
CARTESIAN_REFLEX, COMMUNICATION = 7, 25


class Recovery(AutomaticErrorRecoveryCommand):
    def handle(self, server):
        server.reflex = None
        self.reply(AutomaticErrorRecoveryStatus.kSuccess)


class Move(MoveCommand):
    def handle(self, server):
        if server.reflex is None:
            super().handle(server)
        else:
            self.reply(MoveStatus.kReflexAborted)


class Box(FrankaRobotServer):
    lost, has_begun, target, reflex, is_hit = 0, False, None, None, False

    @property
    def robot_state(self):
        state = super().robot_state
        if self.reflex is None:
            return state
        errors = tuple(i == self.reflex for i in range(41))
        return state.replace(robot_mode=RobotMode.kReflex, errors=errors, reflex_reason=errors)

    def send_state(self):
        try:
            super().send_state()
        except OSError:  # A cut network loses packets.
            pass

    def trip(self, reflex):
        """Stops the motion until a recovery."""
        self.reflex, self.has_begun = reflex, False
        motion = self.current_motion_id
        self.stop_motion(send_preemption_signal=False)
        self.send_state()
        if motion:
            BaseCommand.send_response(self._tcp_socket, RobotCommand.kMove, motion, MoveStatus.kReflexAborted)
        self.reset_current_motion_id()

    def _post_process_commands(self):
        is_new = self._FrankaRobotServer__has_new_command
        is_moving = self._FrankaRobotServer__control_mode is ControlMode.VELOCITY
        self.has_begun = is_moving and (self.has_begun or is_new)
        self.lost = 0 if is_new or not self.has_begun else self.lost + 1
        if not is_moving:
            self.target = None
        if self.lost > LOST_PACKETS or self.is_hit:
            self.trip(CARTESIAN_REFLEX if self.is_hit else COMMUNICATION)
            self.is_hit, self.lost = False, 0
        elif is_moving:
            # The robot integrates velocities to positions; the simulator's own control has no stiffness.
            if self.target is None:
                self.target = np.array(self.robot.inner_state.q)
            velocities = np.array(self._FrankaRobotServer__current_control_command.dq_c)
            self.target += 0.001 * velocities
            # Its position control damps with the velocity; the offset makes up for that.
            ahead = velocities * np.array(self.robot.kv) / np.array(self.robot.kp)
            reported = self.robot._tracked_state_components
            for name, value in (("q_d", self.target.copy()), ("dq_d", velocities)):
                reported[name].set(self.robot._BaseRobot__t, value, call_observers=is_new)
            return self.robot._joint_position_control(self.target + ahead)
        super()._post_process_commands()


class Robot(mujoco_simulator.FrankaMujocoRobot):
    @property
    def state(self):
        wrench = random.normal(0.0, NOISE)
        model, data = self.model, self.data
        if data is not None:
            tip, link = model.geom("tip").id, model.body("robot0_fr3_link7").id
            for i, contact in enumerate(data.contact[:data.ncon]):
                if tip not in (contact.geom1, contact.geom2):
                    continue
                load = np.zeros(6)
                mujoco.mj_contactForce(model, data, i, load)
                force = contact.frame.reshape(3, 3).T @ load[:3]
                force = force if contact.geom2 == tip else -force
                turn = data.xmat[link].reshape(3, 3).T
                torque = np.cross(contact.pos - data.geom_xpos[tip], force)
                # Of the arm on its environment (libfranka, robot_state.h).
                wrench -= np.concatenate([turn @ force, turn @ torque])
        return super().state.replace(K_F_ext_hat_K=tuple(wrench.tolist()))


class Pack:
    """The module `struct` with the layout of the answer to a connection."""

    def __getattr__(self, name):
        return getattr(struct, name)

    def pack(self, layout, *values):
        return struct.pack("<BH5x" if layout == "<HH4x" else layout, *values)


franka_server.struct = Pack()
franka_robot_server.AutomaticErrorRecoveryCommand = Recovery
franka_robot_server.MoveCommand = Move
simulation_server.FrankaRobotServer = Box
mujoco_simulator.FrankaMujocoRobot = Robot

sim = mujoco_simulator.MujocoSimulator()
robot = sim.add_robot(initial_q=home, robot_parameters=RobotParameters(ee_tcp_xyz=(0.0, 0.0, mount), ee_tcp_rpy=(0.0,) * 3))
# Only finger and object touch.
for geom in sim.scene.iter("geom"):
    geom.set("contype", "0")
    geom.set("conaffinity", "0")
link = next(body for body in sim.worldbody.iter("body") if body.get("name") == "robot0_fr3_link7")
rubber = {"contype": "1", "conaffinity": "1", "solref": "0.02 1", "solimp": "0.95 0.99 0.0005"}
ET.SubElement(link, "geom", name="tip", type="sphere", size=str(radius), pos=f"0 0 {FLANGE_M + mount}", mass="0", **rubber)
ET.SubElement(sim.scene.find("asset"), "mesh", name="object", file=mesh)
body = ET.SubElement(sim.worldbody, "body", name="object", pos=f"{x} {y} {z}")
ET.SubElement(body, "geom", type="mesh", mesh="object", **rubber)


def tell(event):
    print(json.dumps({"time_unix_s": time.time(), "event": event}), flush=True)


def hit(_number, _frame):
    Box.is_hit = True


signal.signal(signal.SIGUSR1, hit)
with sim, simulation_server.SimulationServer(sim, ["127.0.0.1"]) as server:
    server.running, is_moving, at = True, False, time.perf_counter()
    tell("serving")
    while True:
        server.run_once(realtime=False)
        if (max(map(abs, robot.inner_state.dq)) > REST) != is_moving:
            is_moving = not is_moving
            tell("moving" if is_moving else "at_rest")
        # Up to 50 ms are caught up.
        at = max(at + 0.001, time.perf_counter() - 0.05)
        time.sleep(max(0.0, at - time.perf_counter()))
