# full_disk.sh: runs every command on disks of growing size, from an empty one to one that holds all results. A command that
# cannot write must say so in a sentence and by its exit code, and leave only whole files. To be sourced after command.sh;
# needs the right to mount (root, or user namespaces).
# shellcheck shell=sh
disk=$work/disk

# Whether a disk can be mounted here.
can_mount() { unshare -m sh -c "mkdir -p '$disk' && mount -t tmpfs -o size=64k none '$disk'" 2>/dev/null; }

# The files under FOLDER that are not whole, one per line.
broken_files() {
  find "$1" -type f | while read -r file; do
    case $file in
    *.part-* | *.flesh.lock) echo "$file: left behind" ;;
    *.png) [ "$(tail -c 8 "$file" | head -c 4)" = IEND ] || echo "$file: half a picture" ;;
    *.html) [ "$(tail -n 1 "$file")" = '</html>' ] || echo "$file: half a page" ;;
    */result.json)
      [ "$(tail -n 1 "$file")" = '}' ] || echo "$file: half an object"
      ! grep -q '"status": "running"' "$file" || echo "$file: still running"
      ;;
    *.json) [ "$(tail -n 1 "$file")" = '}' ] || echo "$file: half an object" ;;
    *.csv | *.yaml | *.txt | *.gp | *.obj | *.msh | *.vtu | *.pvd)
      [ -z "$(tail -c 1 "$file" | tr -d '\n')" ] && { [ -s "$file" ] || [ "${file##*/}" = history.csv ] || [ "${file##*/}" = log.txt ]; } ||
        echo "$file: half a text"
      ;;
    esac
  done
}

# on_disk KILOBYTES COMMAND...: runs the command on a new disk of that size, mounted as `disk`; its exit code goes to code.txt.
on_disk() {
  size=$1
  shift
  mkdir -p "$disk"
  # shellcheck disable=SC2016
  export disk size
  unshare -m sh -c '
    mount -t tmpfs -o "size=$((size + 4))k" none "$disk" && head -c 4096 /dev/zero >"$disk/filler" || exit 99
    "$@" >stdout.txt 2>stderr.txt
    echo $? >code.txt
    . "$source_folder/shared/full_disk.sh"
    broken_files "$disk" >broken.txt
    find "$disk" -type f >files.txt' sh "$@"
}

# fills NAME SIZES COMMAND...: runs the command on disks of these sizes. It must succeed on the last, and fail on some others
# with a sentence.
fills() {
  name=$1 sizes=$2 failures=0 faults=0
  shift 2
  for kilobytes in $sizes; do
    on_disk "$kilobytes" "$@"
    ended=$(cat code.txt) fault=
    [ ! -s broken.txt ] || fault="leaves $(tr '\n' ';' <broken.txt)"
    if [ "$ended" -ne 0 ]; then
      failures=$((failures + 1))
      [ "$ended" -eq 3 ] || fault="$fault ended with $ended"
      grep -qi 'could not be written\|cannot be written\|No space left\|may be full\|is full\|cannot make\|could not write' stderr.txt ||
        fault="$fault without saying why"
    fi
    [ -z "$fault" ] || { faults=$((faults + 1)); echo "$name on $kilobytes kB: $fault"; head -3 stderr.txt; }
  done
  [ "$ended" -eq 0 ] || { echo "$name does not fit on $kilobytes kB:"; cat stderr.txt; faults=$((faults + 1)); }
  [ "$failures" -gt 0 ] || { echo "$name never filled the disk"; faults=$((faults + 1)); }
  [ "$faults" -eq 0 ]
}
