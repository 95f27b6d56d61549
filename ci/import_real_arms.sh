#!/usr/bin/env bash
# Arms that others have published, read by remora-urdf and held to Pinocchio on 100 random states
# each, at 1e-9. By hand: it installs packages from PyPI into a scratch environment. The files are
# not ours to copy (SPARTpy is under the LGPL) and stay there.
#
# Then three of them are imported onto a bus and planned for: shares of plans that are optimal, and that
# can be flown, over drawn scenarios.
#
#     ci/import_real_arms.sh [FOLDER] [COUNT]
#
# FOLDER keeps the environment, the references and the campaigns for the next run; by default a scratch
# one is removed at the end. COUNT scenarios a campaign, 100 by default.
set -euo pipefail
cd "$(dirname "$0")/.."

if [[ $# -gt 0 ]]; then
    mkdir -p "$1"
    work=$(realpath "$1")
else
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
fi

count=${2:-100}

if [[ ! -x $work/venv/bin/python ]]; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet pin==4.1.0 spartpy==1.1.3 example-robot-data==6.0.0
fi
packages=$("$work/venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
robots=$packages/cmeel.prefix/share/example-robot-data/robots

# check NAME URDF END_EFFECTOR HELD FLAGS: HELD for Pinocchio, which follows no mimics; FLAGS for us.
check() {
    local name=$1 urdf=$2 end_effector=$3 locks=$4 flags=$5
    local reference=$work/$name.pinocchio.json
    # shellcheck disable=SC2086 # The locks are words.
    "$work/venv/bin/python" ci/pinocchio_reference.py "$urdf" --end-effector "$end_effector" $locks \
        --count 100 --out "$reference"
    echo "--- $name: $flags"
    REMORA_URDF=$urdf REMORA_URDF_REFERENCE=$reference REMORA_URDF_FLAGS=$flags \
        cargo test --quiet --locked -p remora-urdf --test urdf -- --ignored --nocapture --exact \
        reference::a_file_of_the_environment_is_pinocchios
}

limits=''
for joint in 1 2 3 4 5 6 7; do
    limits+=" --limit Joint_$joint=-3,3,0.1,100"
done
check spartpy "$packages/SPARTpy/urdf/floating_7dof_manipulator.urdf" Link_EE '' "${limits# }"
check ur5 "$robots/ur_description/urdf/ur5_robot.urdf" tool0 '' '--end-effector tool0'
check panda "$robots/panda_description/urdf/panda.urdf" panda_hand_tcp \
    '--hold panda_finger_joint1=0.02 --hold panda_finger_joint2=0.02' \
    '--end-effector panda_hand_tcp --hold panda_finger_joint1=0.02'
check xarm7 "$robots/xarm_description/urdf/xarm7.urdf" link7 '' ''
check z1 "$robots/z1_description/urdf/z1.urdf" gripperMover '' ''
check kinova "$robots/kinova_description/robots/kinova.urdf" j2s6s200_end_effector '' \
    '--end-effector j2s6s200_end_effector'
check talos_left_arm "$robots/talos_data/robots/talos_left_arm.urdf" arm_left_7_link \
    '--hold gripper_left_joint=-0.3' '--end-effector arm_left_7_link --hold gripper_left_joint=-0.3'

cargo build --quiet --release --locked -p remora-cli
remora=${CARGO_TARGET_DIR:-target}/release/remora

# campaigns NAME URDF FLAGS: imports with the flags that `--explain` asks for, then plans.
campaigns() {
    local name=$1 urdf=$2 flags=$3 integrator
    local mission=$work/$name.mission.toml
    echo "=== $name: $flags"
    # shellcheck disable=SC2086 # The flags are words.
    "$remora" mission import "$urdf" $flags --out "$mission" --force
    for integrator in euler rk4; do
        local out=$work/campaign-$name-$integrator
        rm -rf "$out"
        # Status 3 or 1: some plan is not converged, or not flyable. The shares tell.
        "$remora" --quiet campaign --mission "$mission" --count "$count" --seed 1 --integrator "$integrator" \
            --warm-start heuristic --out "$out" || [[ $? -ne 2 ]]
        "$work/venv/bin/python" - "$name" "$integrator" "$out/summary.json" <<'PYTHON'
import json, sys

name, integrator, file = sys.argv[1:]
summary = json.load(open(file))
verdicts, count = summary["by_verdict"], summary["scenarios"]
flown = verdicts["optimal"] + verdicts["verified_not_converged"]
print(f"{name} {integrator}: {verdicts['optimal']} of {count} optimal, {flown} verified, {summary['by_reason']}")
PYTHON
    done
}

bus='--bus fixtures/missions/default.mission.toml'
campaigns spartpy "$packages/SPARTpy/urdf/floating_7dof_manipulator.urdf" "${limits# }"
campaigns ur5 "$robots/ur_description/urdf/ur5_robot.urdf" "--end-effector tool0 $bus"
campaigns panda "$robots/panda_description/urdf/panda.urdf" \
    "--end-effector panda_hand_tcp --hold panda_finger_joint1=0.02 $bus"
