#!/usr/bin/env bash
# Runs a command with a Slurm cluster of one node, which keeps its files in FOLDER and uses only the loopback
# device. Usage, as root: unshare --net bash slurm.sh FOLDER COMMAND...
set -eu
here=$(realpath "$1")
shift
ip link set lo up
# Slurm opens no port if 127.0.0.1 is the only address.
ip addr add 10.77.0.1/32 dev lo
node=$(hostname -s)
mkdir -p "$here/state" "$here/spool" "$here/munge"
chmod 755 "$here" "$here/munge"
export SLURM_CONF=$here/slurm.conf
cat >"$SLURM_CONF" <<CONF
ClusterName=one
SlurmctldHost=$node(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$here/munge/socket
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmUser=root
StateSaveLocation=$here/state
SlurmdSpoolDir=$here/spool
SlurmctldPidFile=$here/slurmctld.pid
SlurmdPidFile=$here/slurmd.pid
SlurmctldLogFile=$here/slurmctld.log
SlurmdLogFile=$here/slurmd.log
ReturnToService=2
KillWait=1
MinJobAge=600
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=main Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
# Ends the daemons, and returns when none writes into the folder any more.
stop() {
    for file in "$here"/slurmd.pid "$here"/slurmctld.pid "$here"/munge/pid; do
        [ -s "$file" ] || continue
        pid=$(cat "$file")
        kill "$pid" 2>/dev/null || continue
        timeout 30 tail -s 0.1 --pid="$pid" -f /dev/null || kill -KILL "$pid" || true
    done
}
trap stop EXIT
head -c 1024 /dev/urandom >"$here/munge/key"
chmod 400 "$here/munge/key"
munged --force --key-file="$here/munge/key" --socket="$here/munge/socket" --pid-file="$here/munge/pid" \
    --log-file="$here/munge/log" --seed-file="$here/munge/seed"
slurmctld
slurmd
for _ in $(seq 60); do
    if sinfo --noheader --format %T 2>/dev/null | grep -q idle; then break; fi
    sleep 0.5
done
"$@"
