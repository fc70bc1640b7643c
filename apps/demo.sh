#!/usr/bin/env bash
# The whole chain on a phantom: image -> meshes -> calibration -> registration -> tracked, deforming organ -> report.
#     apps/demo.sh [FOLDER]      (default: demo)
source "$(dirname "$0")/setup.sh" -DBUILD_TESTING=OFF -DLIVETET_BENCHMARKS=OFF
demo=${1:-$root/demo}

say "1. what a user would have brought: an MR-like image, labels, fiducials, tracker recordings"
"$livetet" phantom -o "$demo"
cd "$demo"

say "2. label map -> a hierarchy of tetrahedral meshes"
"$livetet" mesh labels.nii.gz --fix fixed_mask.nii.gz --tets 6000 -o liver.h5

say "3. the tool's tip; the registration of the image to the reference sensor"
"$livetet" calibrate pivot pivot.igs.mha --tool Stylus -o tip.json
"$livetet" register --tracker fiducials.igs.mha --tip tip.json --reference Reference --image image_fiducials.mrk.json -o registration.json

say "4. the recording, played at its own pace"
"$livetet" track scene.yaml

say "5. how far off it was: the report, with the truth that track never read"
"$livetet" report result.h5 --truth truth/truth.json

say "6. the pressed organ once more, without a sensor: a stylus is led over it, and the deformation is found meanwhile"
# 3: not converged. Then the report says so, and the demo goes on.
"$livetet" register --deform sweep.yaml --live --surface-points sweep.igs.mha --tip tip.json --registration registration.json || { status=$?; [ $status -eq 3 ] || exit $status; }
"$livetet" report swept.h5 --truth truth/truth.json

say "7. a resection: on a grid of the image's voxels a tracked scalpel cuts the organ, then the sensor presses it beside the cut"
"$livetet" track resection.yaml
"$livetet" warp resection.h5 --image image.nii.gz --time 10 -o resection.nii.gz
"$livetet" view resection.h5 --screenshot resection.png

say "done: look at report.txt and the pictures in $demo/result.report and $demo/resection.report, and at $demo/resection.png; watch a run by $livetet view $demo/result.h5 (or resection.h5), or in ParaView $demo/result.xdmf"
