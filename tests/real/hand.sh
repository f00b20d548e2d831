#!/bin/sh
# Writes contacts of a real iCub hand and meshes of the objects for tests/suite/real_hand.rs.
#
#     git clone https://github.com/robotology/visual-tactile-localization
#     sh tests/real/hand.sh visual-tactile-localization hand
#     PALPATE_REAL_HAND=hand cargo test --locked --test suite -- --ignored real_hand
#
# They are in the history of the repository, before its licence, so they are not part of Palpate. Vezzani et al.,
# Memory Unscented Particle Filter, arXiv 1607.02757.
set -eu
repository=$1 out=$2
mkdir -p "$out"
show() { git -C "$repository" show "$1" > "$out/$2"; }
for name in Lego Cylinder Robot Cleaner; do
    show "096dbba:measurements/meas${name}_exp.off" "contacts_$(echo "$name" | tr 'A-Z' 'a-z').off"
done
show 381e252:localizerDir/measurements/measSpray.off contacts_spray.off
show 381e252:localizerDir/measurements/measSpray2.off contacts_spray2.off
show 381e252:localizerDir/measurements/measRobot.off contacts_robot2.off
for name in legoBox cylinder robot spray box; do
    show "096dbba:models/$name.off" "mesh_$name.off"
done
show f046330:models/cleaner.off mesh_cleaner.off
show 8d55091:models/mustard.off mesh_mustard.off
