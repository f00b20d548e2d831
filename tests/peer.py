"""Independent peer for ROS 2, written from the table of topics alone.

    peer.py touch ADDRESS [hand|fingers]   moves a stage along -y until the finger detects contact, and back
    peer.py listen ADDRESS SECONDS         counts and checks the messages of an explorer
    peer.py arm ADDRESS SECONDS            simulates an arm at rest that answers services
    peer.py echo ADDRESS SECONDS           answers every command with a joint state of the same stamp

Prints one JSON object; exits with 1 if a message differs from the table. The address is a ROS 2 domain. A `link` opens topics and sends messages: `inbox(name)` returns the messages since its last use, `drive(names,
velocities)` sends a command, `engage()` enables the arm, `seconds(stamp)` and `validity_ns(point)` read times,
`echo(span)` answers and counts commands, `arm(span)` simulates an arm.
"""
import json
import math
import sys
import time

VALID_NS = 30_000_000


def touch(link, tactile):
    """Makes one touch with a stage of three slides X, Y, Z: down at 15 mm/s until the pressure rises, and back."""
    is_hand = tactile == "hand"
    joints, wrench, status = map(link.inbox, ("/joint_states", "/ft_sensor/wrench", "/pa10/status"))
    frames = link.inbox("/biotac_pub" if is_hand else "/biotac_pub as BiotacAll")
    counts = {"joints": 0, "wrench": 0, "status": 0, "frames": 0}
    rest, felt, pressures, y, moved = [], None, [], [], False
    problems = set(link.engage())
    begun = time.time()
    while time.time() - begun < 12:
        for message in joints.take():
            counts["joints"] += 1
            if list(message.name) != ["X", "Y", "Z"] or len(message.position) != 3 or len(message.velocity) != 3:
                problems.add(f"joint names {message.name}")
            if abs(link.seconds(message.header.stamp) - time.time()) > 0.5:
                problems.add("the stamp of a joint state is not the current time")
            y.append(message.position[1])
        for message in wrench.take():
            counts["wrench"] += 1
            if not all(map(math.isfinite, (message.wrench.force.x, message.wrench.torque.z))):
                problems.add("a force is not a number")
        for message in status.take():
            counts["status"] += 1
            if message.status[0].name != "pa10" or not message.status[0].values:
                problems.add("a status of another device")
        for message in frames.take():
            counts["frames"] += 1
            data = message.bt_data[0] if is_hand else message.tactiles[0]
            electrodes = data.electrode_data if is_hand else data.electrodes
            pressures.append(data.pdc_data if is_hand else data.pdc)
            if len(electrodes) != 19 or not all(0 < value < 4096 for value in electrodes):
                problems.add(f"electrodes {electrodes}")
        at = time.time() - begun
        # Rest for a second, move down, and move back as soon as the pressure has risen.
        speed = 0.0
        if at < 1.0:
            rest = pressures[-20:]
        elif felt is None:
            speed, moved = -0.015, True
            mean = sum(rest) / max(len(rest), 1)
            if rest and len(pressures) > 3 and min(pressures[-3:]) > mean + 10:
                felt = y[-1]
        elif y[-1] < felt + 0.01:
            speed = 0.02
        else:
            break
        link.drive(["X", "Y", "Z"], [0.0, speed, 0.0])
        time.sleep(0.004)
    if felt is None or not moved:
        problems.add("no contact was detected")
    if min(counts.values()) < 20:
        problems.add("a topic has no messages")
    print(json.dumps({"felt_y_m": felt, "counts": counts, "problems": sorted(problems)}))
    return not problems


def listen(link, span):
    commands = link.inbox("/pa10/joint_velocity_cmd")
    count, fastest, problems, ages = 0, 0.0, set(), []
    begun = time.time()
    while time.time() - begun < span:
        for message in commands.take():
            count += 1
            point = message.points[0]
            fastest = max([fastest, *map(abs, point.velocities)])
            ages.append(time.time() - link.seconds(message.header.stamp))
            if len(message.points) != 1 or len(set(message.joint_names)) != len(point.velocities):
                problems.add(f"names {message.joint_names}")
            if not all(math.isfinite(value) for value in point.velocities) or point.positions:
                problems.add("velocities are not numbers")
            if link.validity_ns(point) != VALID_NS:
                problems.add("a validity differs from the table")
        time.sleep(0.001)
    if count < 100 * span / 2 or fastest == 0.0:
        problems.add("too few messages were sent")
    if ages and sorted(ages)[len(ages) // 2] > 0.1:
        problems.add("stamps are not the current time")
    print(json.dumps({"commands": count, "fastest_rad_s": fastest, "problems": sorted(problems)}))
    return not problems


def main(open_link):
    what, address, more = sys.argv[1], sys.argv[2], sys.argv[3:]
    link = open_link(address)
    if what == "touch":
        done = touch(link, more[0] if more else "hand")
    elif what == "listen":
        done = listen(link, float(more[0]))
    elif what == "arm":
        print(json.dumps({"called": link.arm(float(more[0]))}))
        done = True
    else:
        print(json.dumps({"echoed": link.echo(float(more[0]))}))
        done = True
    sys.exit(0 if done else 1)
