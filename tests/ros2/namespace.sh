#!/usr/bin/env bash
# Runs a command in its own network namespace, isolated from the network; DDS finds its peers by multicast.
# Usage: unshare --map-root-user --net bash namespace.sh COMMAND...
set -eu
ip link set lo up
ip link set lo multicast on
# A dummy device carries multicast like a real one; if it cannot be created, the loopback device is used.
if ip link add dds0 type dummy 2>/dev/null; then
    ip addr add 10.77.0.1/24 dev dds0
    ip link set dds0 up multicast on
    ip route add 224.0.0.0/4 dev dds0
else
    ip route add 224.0.0.0/4 dev lo
fi
# An idle virtual processor wakes late, by up to tens of milliseconds. A busy loop of idle priority per
# processor avoids this. The loop polls whether this script still runs, because a signal that arrives while a
# process starts can be lost.
awake=()
trap '[ ${#awake[@]} -eq 0 ] || kill "${awake[@]}"' EXIT
if command -v chrt >/dev/null; then
    for _ in $(seq "$(nproc)"); do
        chrt --idle 0 bash -c 'while kill -0 "$1" 2>/dev/null; do :; done' spend "$$" &
        awake+=($!)
    done
fi
"$@"
