#!/usr/bin/env bash
# A campaign in parts under Slurm, on this machine alone: controller, node and authentication start as plain
# processes in a scratch folder, an array job makes the parts, one task is ended half-way and run again, and the rows
# must be those of a campaign in one part. All of it is gone at the end. By hand, as root, in about a minute:
#
#     apt-get install slurmctld slurmd slurm-client munge
#     ci/slurm.sh [PROGRAM]        the program: built where none is named
set -euo pipefail
cd "$(dirname "$0")/.."

for needed in slurmctld slurmd sbatch munged mungekey; do
    command -v "$needed" >/dev/null || {
        echo "error: missing: $needed (Debian: slurmctld slurmd slurm-client munge)" >&2
        exit 1
    }
done
if [ $# -gt 0 ]; then
    remora=$(realpath "$1")
else
    cargo build --quiet --release --locked --bin remora
    remora=$(realpath "${CARGO_TARGET_DIR:-target}/release/remora")
fi

scratch=$(mktemp -d /tmp/remora-slurm.XXXXXX)
started=()
finish() {
    local status=$?
    [ "$status" -eq 0 ] || tail -n 5 "$scratch"/*.log >&2 || true
    for process in "${started[@]}"; do
        kill "$process" 2>/dev/null || true
        wait "$process" 2>/dev/null || true
    done
    rm -rf "$scratch"
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# start NAME COMMAND... - in the foreground of a process of this shell.
start() {
    "${@:2}" >"$scratch/$1.log" 2>&1 &
    started+=($!)
}

# await SECONDS COMMAND...
await() {
    local end=$((SECONDS + $1))
    until "${@:2}" >/dev/null 2>&1; do
        [ $SECONDS -lt $end ] || {
            echo "error: in $1 s not: ${*:2}" >&2
            exit 1
        }
        sleep 0.2
    done
}

# Munge wants folders that nobody else can write.
chmod 755 "$scratch"
mkdir -m 700 "$scratch/munge" "$scratch/state" "$scratch/spool"
mungekey --create --keyfile="$scratch/munge/key"
socket=$scratch/munge/socket
start munged munged --foreground --force --key-file="$scratch/munge/key" --socket="$socket" \
    --pid-file="$scratch/munge/pid" --seed-file="$scratch/munge/seed" --log-file="$scratch/munge/log"

host=$(hostname -s)
cores=$(nproc)
cat >"$scratch/slurm.conf" <<CONF
ClusterName=remora
SlurmctldHost=$host(localhost)
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/munge
AuthInfo=socket=$socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$scratch/state
SlurmdSpoolDir=$scratch/spool
SlurmctldPidFile=$scratch/slurmctld.pid
SlurmdPidFile=$scratch/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobCompType=jobcomp/none
AccountingStorageType=accounting_storage/none
NodeName=$host NodeAddr=localhost CPUs=$cores State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$scratch/slurm.conf
await 10 test -S "$socket"
start slurmctld slurmctld -D
start slurmd slurmd -D
await 20 sh -c 'sinfo --noheader --states=idle --format=%n | grep -q .'

"$remora" --quiet campaign --count 40 --seed 3 --integrator euler --part 1/1 --out "$scratch/whole"
# The job of docs/guides/campaigns.md, with this program and a small campaign.
awk '/^```/ { inside = 0 } /^#!\/bin\/sh$/ { inside = 1 } inside' docs/guides/campaigns.md |
    sed -e "s|exec remora |exec $remora |" -e 's/--count 1000000 --seed 9 /--count 40 --seed 3 /' \
        -e 's/--array=1-1000$/--array=1-8/' -e 's|/1000"|/8"|' -e "s|/shared/a|$scratch/parts|" >"$scratch/job.sh"
cat "$scratch/job.sh"
for word in "$remora" --count\ 40 --array=1-8 '/8"' "$scratch/parts"; do
    grep -qF -- "$word" "$scratch/job.sh" || {
        echo "error: docs/guides/campaigns.md: the job lacks what $word stands for" >&2
        exit 1
    }
done
submit() {
    sbatch --parsable --chdir="$scratch" --output="$scratch/task-%a.out" "$@" "$scratch/job.sh"
}
job=$(submit)
# The first task is ended as a node's owner would.
await 20 sh -c "cat '$scratch'/parts/part-*.journal.jsonl"
scancel --signal=TERM --batch "${job}_1" || true
await 120 sh -c "! squeue --noheader --job=$job 2>/dev/null | grep -q ."
"$remora" campaign gather "$scratch/parts" || echo "not all yet: submitted again"
job=$(submit)
await 120 sh -c "! squeue --noheader --job=$job 2>/dev/null | grep -q ."

checksum() {
    "$remora" campaign gather "$1" --recompute 4 --json | sed -n 's/.*"checksum": "\(.*\)".*/\1/p'
}
whole=$(checksum "$scratch/whole")
parts=$(checksum "$scratch/parts")
echo "in one part $whole, in eight under Slurm $parts"
[ -n "$whole" ] && [ "$whole" = "$parts" ]
