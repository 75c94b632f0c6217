# TEST full memory program seconds=120 needs=flesh
# test_command_pictures.sh: `flesh snap` and `flesh film`: their pictures, videos and refusals. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

"$flesh" mesh box --cells 6,2,2 --size 3,1,1 --out bar.msh >/dev/null || exit 1
"$flesh" mesh surface bar.msh skin.obj >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, constants: matched, young: 1e5, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {step: 1/60, end: 1/10}
END
"$flesh" run bar.yaml --out soft --quiet || exit 1
"$flesh" run bar.yaml --out stiff --quiet --set body.material.young=1e6 || exit 1

# A stand-in for ffmpeg, which notes its arguments and writes a file.
mkdir fake none
cat >fake/ffmpeg <<'END'
#!/bin/sh
echo "$@" >../called.txt
[ ! -e ../refuse ] || { echo 'no such codec' >&2; exit 1; }
for last; do :; done
echo video >"$last"
END
chmod +x fake/ffmpeg
with_ffmpeg() { env PATH="$PWD/fake:$PATH" "$@"; }
without_ffmpeg() { env PATH="$PWD/none" "$@"; }

# size FILE: prints "width height" of a PNG.
size() {
  [ "$(head -c 4 "$1" | tail -c 3)" = PNG ] || { echo "$1 is no PNG"; return 1; }
  od -An -j16 -N8 -tu1 "$1" | awk '{ print $3 * 256 + $4, $7 * 256 + $8 }'
}

a_run_is_drawn() {
  expect 0 "$flesh" snap soft --out a.png --width 200 --picture-height 120 || return 1
  has stdout.txt 'soft: frame 6, t = 0.1 s' && has stdout.txt 'up: (0, 0, 1), against gravity' &&
    has stdout.txt 'colours: volume ratio J_mean from 0.99 to 1.01; there is 0.99.* to 1.00' &&
    has stdout.txt 'picture: a.png' || return 1
  [ "$(size a.png)" = '324 176' ] || { size a.png; return 1; }
  expect 0 "$flesh" snap soft --out a2.png --width 200 --picture-height 120 --frame 6 && cmp a.png a2.png || return 1
  expect 0 "$flesh" snap soft --out a3.png --width 200 --picture-height 120 --time 0.1 && cmp a.png a3.png || return 1
  expect 0 "$flesh" snap soft --out a4.png --width 200 --picture-height 120 --time 0 && ! cmp -s a.png a4.png
}

fields_and_cameras_make_a_difference() {
  for options in '--colour none' '--colour speed' '--colour stress' '--camera 90,-10' '--edges' '--target 0,0,0' \
    '--height 9' '--field-of-view 0' '--range 0.9,1.1' '--bare' '--flat' '--up 0,1,0'; do
    # shellcheck disable=SC2086
    expect 0 "$flesh" snap soft --out b.png --width 200 --picture-height 120 $options || return 1
    ! cmp -s a.png b.png || { echo "$options changes nothing"; return 1; }
  done
}

# A warning says that a picture is empty, if the camera looks elsewhere, from too near or from too far.
an_empty_picture_is_told() {
  for options in '--target 1e300,0,0' '--target 0,20,0 --height 3' '--target 2,0,3 --height 1 --field-of-view 0' \
    '--camera 180,0 --target 2,-30,0.5 --height 1' '--height 1e5'; do
    # shellcheck disable=SC2086
    expect 0 "$flesh" snap soft --out b.png --width 80 --picture-height 50 $options && has stdout.txt 'warning: nothing is seen' ||
      { echo "$options is not told"; return 1; }
  done
  for options in '--target 2,0,0 --height 1' '--height 90' '--target 2,0,3 --height 1 --field-of-view 119'; do
    # shellcheck disable=SC2086
    expect 0 "$flesh" snap soft --out b.png --width 80 --picture-height 50 $options && ! has stdout.txt 'warning:' ||
      { echo "$options is told to show nothing"; return 1; }
  done
}

the_camera_comes_from_the_scene() {
  expect 0 "$flesh" run bar.yaml --out seen --quiet --set output.camera.azimuth=90 --set output.camera.elevation=-10 \
    --set output.camera.height=4 --set output.camera.target='[1.5, 0.5, 0.5]' || return 1
  expect 0 "$flesh" snap seen --out c.png --width 160 && expect 0 "$flesh" snap soft --out d.png --width 160 --camera 90,-10 --height 4 \
    --target 3/2,1/2,1/2 && cmp c.png d.png
}

# The same scene along other axes, seen with its own way up, is the same picture.
up_is_found_and_chosen() {
  "$flesh" mesh box --cells 3,3,3 --size 1,1,1 --out cube.msh >/dev/null || return 1
  for axis in 0,0,-1:0,0,1 0,-1,0:0,1,0 -1,0,0:1,0,0; do
    pull=${axis%%:*} up=${axis##*:}
    cat >up.yaml <<END
body:
  mesh: cube.msh
  material: {energy: S, young: 1e5, poisson: 0.45}
effects:
  - gravity: {acceleration: [$pull]}
  - contact: {plane: {point: [-0.5, -0.5, -0.5], normal: [$up]}}
END
    expect 0 "$flesh" snap up.yaml --out up.png --colour none --camera 0,30 --width 80 --picture-height 50 && has stdout.txt 'against gravity' ||
      return 1
    expect 0 "$flesh" snap up.yaml --out up2.png --colour none --camera 0,30 --width 80 --picture-height 50 --up "$up" &&
      has stdout.txt 'as --up says' && cmp up.png up2.png || return 1
    [ ! -e first.png ] || cmp first.png up.png || { echo "up $up makes another picture"; return 1; }
    cp up.png first.png
  done
  expect 0 "$flesh" snap up.yaml --out up3.png --colour none --width 80 --picture-height 50 --up 0,0,1 && ! cmp -s up.png up3.png || return 1
  expect 0 "$flesh" snap soft up.yaml --out up3.png --width 80 --picture-height 50 && has stdout.txt 'gravity; in up.yaml it would be (1, 0, 0)' || return 1
  sed '/gravity/d' up.yaml >still.yaml
  expect 0 "$flesh" snap still.yaml --out up4.png --width 80 --picture-height 50 && has stdout.txt 'up: (0, 0, 1), as there is no gravity' || return 1
  echo 'output: {camera: {up: [0, 2, 0]}}' >>still.yaml
  expect 0 "$flesh" snap still.yaml --out up4.png --width 80 --picture-height 50 && has stdout.txt 'up: (0, 1, 0), as the scene says'
}

frames_are_numbered_as_their_files() {
  expect 0 "$flesh" run bar.yaml --out sparse --quiet --set output.frame_interval=4 || return 1
  ls sparse/frames/*.vtu | tr -d '\n' | grep -q '000000.vtu.*000004.vtu.*000006.vtu$' || { ls sparse/frames; return 1; }
  expect 0 "$flesh" snap sparse --out k.png --width 200 --picture-height 120 --frame 4 &&
    has stdout.txt 'sparse: frame 4, t = 0.0666667 s' || return 1
  expect 0 "$flesh" snap soft --out l.png --width 200 --picture-height 120 --frame 4 && cmp k.png l.png || return 1
  expect 2 "$flesh" snap sparse --out x.png --frame 1 &&
    has stderr.txt 'frames of sparse are 0, 4 and 6, numbered as its files (sparse/frames/frame_000006.vtu)' || return 1
  expect 2 "$flesh" snap bar.yaml --out x.png --frame 1 && has stderr.txt 'no frames but its start, which is number 0' &&
    expect 0 "$flesh" snap bar.yaml --out x.png --frame 0 && rm x.png
}

runs_stand_side_by_side() {
  expect 0 "$flesh" snap soft stiff --out two.png --width 200 --picture-height 120 || return 1
  [ "$(size two.png)" = '534 180' ] || { size two.png; return 1; }
  expect 0 "$flesh" snap soft stiff --out strip.png --width 200 --picture-height 120 --time 0,0.05,0.1 || return 1
  [ "$(size strip.png)" = '744 350' ] || { size strip.png; return 1; }
}

a_scene_is_drawn_at_its_start() {
  expect 0 "$flesh" snap bar.yaml --out e.png --width 200 --picture-height 120 && cmp e.png a4.png
}

a_skin_is_drawn() {
  expect 0 "$flesh" run bar.yaml --out skinned --quiet --set output.skin.surface=skin.obj || return 1
  expect 0 "$flesh" snap skinned --out f.png --width 160 --no-skin && expect 0 "$flesh" snap soft --out g.png --width 160 && cmp f.png g.png ||
    return 1
  "$flesh" mesh box --cells 6,2,2 --size 3,1,1.5 --out thick.msh >/dev/null
  "$flesh" mesh surface thick.msh thick.ply >/dev/null
  expect 0 "$flesh" snap soft --out h.png --width 160 --surface thick.ply && ! cmp -s f.png h.png
}

obstacles_are_drawn() {
  cat >drop.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, constants: matched, young: 1e5, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {}
  - contact: {plane: {point: [0, 0, -0.1], normal: [0, 0, 1]}}
time: {step: 1/60, end: 1/10}
END
  expect 0 "$flesh" snap drop.yaml --out i.png --width 80 --picture-height 50 --colour none || return 1
  expect 0 "$flesh" snap bar.yaml --out j.png --width 80 --picture-height 50 --colour none && ! cmp -s i.png j.png || return 1
  expect 0 "$flesh" snap drop.yaml --out j.png --width 80 --picture-height 50 --colour none --no-shadow && ! cmp -s i.png j.png || return 1
  # Seen from below, the plane is translucent: the bar shows through it.
  sed '/contact/d' drop.yaml >free.yaml
  for scene in drop free; do
    expect 0 "$flesh" snap $scene.yaml --out $scene.png --width 160 --picture-height 100 --colour none --camera 30,-40 --bare --target 1.5,0.5,0.5 \
      --height 2 || return 1
  done
  ! cmp -s drop.png free.png
}

a_film_is_made() {
  expect 0 with_ffmpeg "$flesh" film soft stiff --out film.mp4 --width 100 || return 1
  has stdout.txt 'film.mp4: 7 pictures at 60 per second' && [ -s film.mp4 ] && [ ! -e film_frames ] || return 1
  has called.txt '-framerate 60 -f image2 -i ./frame_%06d.png' || return 1
  expect 0 with_ffmpeg "$flesh" film soft --out film.mp4 --width 100 --every 2 --fps 10 --keep || return 1
  has stdout.txt '4 pictures at 10 per second' && [ "$(ls film_frames | wc -l)" -eq 4 ] &&
    ! find . -name '*.part-*' | grep .
}

without_ffmpeg_the_pictures_stay() {
  expect 3 without_ffmpeg "$flesh" film soft --out none.mp4 --width 100 || return 1
  has stderr.txt 'ffmpeg is not installed (Debian package ffmpeg); the 7 pictures are in none_frames' || return 1
  [ "$(ls none_frames | wc -l)" -eq 7 ] && [ ! -e none.mp4 ] || return 1
  expect 0 without_ffmpeg "$flesh" film soft --out pictures --width 100 && [ "$(ls pictures | wc -l)" -eq 7 ] ||
    return 1
  expect 0 "$flesh" film soft --out pictures --width 100 --every 3 && [ "$(ls pictures | wc -l)" -eq 3 ]
}

ffmpeg_s_refusal_is_told() {
  touch refuse
  expect 3 with_ffmpeg "$flesh" film soft --out bad.mp4 --width 100
  code=$?
  rm refuse
  [ "$code" -eq 0 ] && has stderr.txt 'ffmpeg failed, its messages are in bad_frames/ffmpeg.log' &&
    has bad_frames/ffmpeg.log 'no such codec' && [ ! -e bad.mp4 ] && ! find . -name '*.part-*' | grep .
}

a_real_ffmpeg_makes_a_real_film() {
  command -v ffmpeg >/dev/null || { echo skipped; return 0; }
  expect 0 "$flesh" film soft --out real.mp4 --width 161 || return 1
  [ "$(head -c 8 real.mp4 | tail -c 4)" = ftyp ]
}

what_is_wrong_is_said() {
  expect 2 "$flesh" snap soft && has stderr.txt '\--out is missing; it must be a file whose name ends in .png' || return 1
  expect 3 "$flesh" snap nowhere --out x.png && has stderr.txt 'no such folder of a run, nor a scene' || return 1
  expect 3 "$flesh" snap fake --out x.png && has stderr.txt 'it has no scene.yaml' || return 1
  expect 2 "$flesh" snap soft --out x.png --colour heat && has stderr.txt "'heat'; it must be none, J, stress, speed or young" || return 1
  expect 2 "$flesh" snap soft --out x.png --camera 30 && has stderr.txt 'must be two angles' || return 1
  expect 2 "$flesh" snap soft --out x.png --range 2,1 && has stderr.txt 'two numbers, the smaller first' || return 1
  expect 2 "$flesh" snap soft --out x.png --frame 7 && has stderr.txt 'the frames of soft are 0, 1, 2 to 6,' || return 1
  expect 2 "$flesh" snap soft --out x.png --frame 1.5 && has stderr.txt 'numbers of frames, as in the names' || return 1
  expect 2 "$flesh" snap soft --out x.png --up 0,0,0 && has stderr.txt "it must be a direction, such as 0,1,0" || return 1
  expect 0 "$flesh" snap soft --out x.png --up 0,3e200,4e200 && has stdout.txt '^up: (0, 0.6, 0.8), as --up says$' || return 1
  rm x.png
  expect 2 "$flesh" snap soft --out x.png --width 9 && has stderr.txt '\--width is 9; it must be 16 to 8192 pixels' || return 1
  expect 2 "$flesh" film soft --out x.avi && has stderr.txt 'a video named .mp4, .mkv, .webm or .gif' && [ ! -e x.avi ] || return 1
  expect 2 "$flesh" snap --out x.png && has stderr.txt 'missing RUN...;' || return 1
  expect 2 "$flesh" film bar.yaml --out x.mp4 && has stderr.txt 'there is only one frame' || return 1
  cp -r soft cut && head -c 3000 soft/frames/frame_000003.vtu >cut/frames/frame_000003.vtu || return 1
  expect 3 "$flesh" snap cut --out x.png --frame 3 && has stderr.txt 'frame_000003.vtu' || return 1
  rm cut/frames/frame_000003.vtu
  expect 3 "$flesh" film cut --out x.mp4 && has stderr.txt 'cannot be opened' || return 1
  [ ! -e x.png ] && [ ! -e x.mp4 ]
}

run_tests a_run_is_drawn fields_and_cameras_make_a_difference \
  an_empty_picture_is_told the_camera_comes_from_the_scene up_is_found_and_chosen \
  frames_are_numbered_as_their_files runs_stand_side_by_side \
  a_scene_is_drawn_at_its_start a_skin_is_drawn obstacles_are_drawn a_film_is_made without_ffmpeg_the_pictures_stay \
  ffmpeg_s_refusal_is_told a_real_ffmpeg_makes_a_real_film what_is_wrong_is_said
