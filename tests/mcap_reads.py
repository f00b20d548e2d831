"""Reads a recording with Python's mcap and its ROS 2 decoder: every schema is known, every message decodes,
and the ticks match the joint states."""

import collections
import json
import sys

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

counts = collections.Counter()
joints, ticks = [], []
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
    assert reader.get_header().profile == "ros2"
    summary = reader.get_summary()
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr"), channel.topic
    for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
        counts[f"{channel.topic} {schema.name}"] += 1
        if channel.topic == "/joint_states":
            joints.append(list(decoded.position))
        elif channel.topic == "/palpate/tick" and not decoded.fault:
            ticks.append(list(decoded.q))
            for frame in decoded.frames:
                assert len(frame.electrodes) in (0, 19) and len(frame.pac) in (0, 22), frame
        elif channel.topic == "/palpate/touch":
            row = json.loads(decoded.row)
            assert row["target"]["place"] == list(decoded.target)
            assert row["outcome"]["end"] == decoded.outcome and decoded.outcome in ("contact", "miss", "overload")
        elif channel.topic == "/palpate/belief":
            assert len(decoded.points) == len(decoded.colors) and len(decoded.points) % 3 == 0
            assert decoded.mesh_file.filename == "" and decoded.pose.orientation.w == 1.0
    about = {record.name: record.metadata for record in reader.iter_metadata()}
assert joints == ticks and len(ticks) > 100
assert "resolved.toml" in about["palpate"] and "palpate_ending" in about
for name, count in sorted(counts.items()):
    print(f"{count:7} {name}")
