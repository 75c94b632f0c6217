#!/bin/sh
# TEST quick program needs=flesh args: @flesh@
# test_mesh_command.sh FLESH: the mesh command's output, sentences and exit codes, as TAP.
flesh=$(realpath "$1")
meshes=$(cd "$(dirname "$0")/../../data/meshes" && pwd)
reference=$(cd "$(dirname "$0")/../reference/meshes" && pwd)
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
number=0

# check NAME CODE TEXT ARGUMENT...: `flesh mesh ARGUMENT...` ends with CODE and prints TEXT.
check() {
  name=$1 code=$2 text=$3
  shift 3
  number=$((number + 1))
  "$flesh" mesh "$@" > out 2>&1
  found=$?
  if [ $found = "$code" ] && grep -qF -- "$text" out; then
    echo "ok $number - $name"
  else
    echo "not ok $number - $name"
    echo "# flesh mesh $* gave $found, not $code, or lacks: $text"
    sed 's/^/# /' out
  fi
}

"$flesh" mesh convert --refine 1 "$meshes/two_regions.mesh" fine_regions.mesh > out 2>&1
"$flesh" mesh convert --refine 1 "$reference/ball_finer.msh" fine_ball.msh >> out 2>&1
check help 0 'Usage: flesh mesh COMMAND' --help
check box_help 0 '--cells NX,NY,NZ' box --help
check info_help 0 'radius ratio' info --help
check convert_help 0 'IN OUT' convert --help
check no_command 2 'the commands are info, convert, surface, box and split'
check unknown_command 2 "unknown command 'bend'" bend
check no_file 2 'missing FILE' info
check unknown_option 2 'unknown or ambiguous option --deep' info --deep a.msh
check option_for_value 2 'option --out needs a value' box --cells 1,1,1 --size 1,1,1 --out --order 2
check missing_file 3 'nothing.msh: cannot be opened: No such file or directory' info nothing.msh
check box 0 'bar.msh: 425 nodes, 1536 tets, 1 region' \
  box --cells 16,4,4 --size 4,1,1 --out bar.msh
check split_help 0 'MESH --parts N --out FOLDER' split --help
check split 0 'bar_parts/index.txt: 425 nodes, 1536 tets, 1 region, in 1 part of 1536 to 1536 tets, with 0.0 % more' \
  split bar.msh --parts 1 --out bar_parts
check split_is_read 0 'volume         4 m^3' info bar_parts/index.txt
check split_into_itself 2 'is read' split bar_parts/index.txt --parts 1 --out bar_parts
check split_without_parts 2 '--parts is missing; it must be a number of parts from 1' split bar.msh --out no
check split_without_out 2 '--out is missing; it must be a folder' split bar.msh --parts 1
check box_in_parts 0 'box_parts/index.txt: 425 nodes, 1536 tets, 1 region, in 6 parts of 192 to 288 tets' \
  box --cells 16,4,4 --size 4,1,1 --parts 6 --out box_parts
check box_in_parts_is_read 0 '425' info box_parts/index.txt
check box_in_too_many_parts 2 '17 parts cannot be blocks of 16 x 4 x 4 cells' \
  box --cells 16,4,4 --size 4,1,1 --parts 17 --out no
check box_beyond_ints 2 'at most 715827882 and 536870911 are supported' \
  box --cells 1000,1000,1000 --size 4,1,1 --parts 8 --out no
check box_in_parts_of_ten_nodes 2 'with --parts it must be 1' \
  box --cells 16,4,4 --size 4,1,1 --parts 6 --order 2 --out no
check convert_keeps_sets 0 'sets.msh: 23 nodes, 48 tets, 2 regions, 2 named sets' \
  convert "$reference/two_boxes_41_ascii.msh" sets.msh
torn() { printf 'nodes 7\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 0\n1 %s 0\n0 0 -1\ntets 2\n0 1 2 3\n4 5 2 6\n' "$1" > torn.txt; }
torn 1e-5
check torn_mesh 0 'coincident     2 nodes where another is, for example 0 and 4: the mesh is torn there' info torn.txt
torn 2e-3
check node_apart 0 'coincident     1 node where another is, for example 0 and 4' info torn.txt
# Nodes on two edges of a flat tet coincide, which does not make a mesh torn.
printf 'nodes 4\n0 0 0\n1 0 0\n1 1 1e-6\n0 1 0\ntets 1\n0 1 2 3\n' >flat.txt
check flat_tet_of_ten 0 '10 nodes, 1 tet of ten nodes' convert --order 2 flat.txt flat.msh
check flat_tet 0 '1 of ten nodes, 0 of them curved' info flat.msh
number=$((number + 1))
if grep -q coincident out; then echo "not ok $number - flat_tet_is_whole"; else echo "ok $number - flat_tet_is_whole"; fi
check kept_sets 0 "    'right'  0 nodes, 24 tets" info sets.msh
check sets_of_one_region 0 "    'right'  0 nodes, 24 tets, region 9" info sets.msh
check convert_without_sets 0 'sets.mesh: 23 nodes, 48 tets, 2 regions; without the 2 named sets, which only .msh holds' \
  convert "$reference/two_boxes_41_ascii.msh" sets.mesh
check box_info 0 'volume         4 m^3' info bar.msh
check box_origin 0 'b.node: 24 nodes, 36 tets' \
  box --cells 1,2,3 --size 1,1/2,1e-1 --origin -1,-2,-3 --out b.node
check box_place 0 'x [m]          -1             to 0' info b.ele
check missing_cells 2 '--cells is missing; it must be three whole numbers' \
  box --size 1,1,1 --out c.msh
check bad_cells 2 "--cells is '1,2.5,3'; it must be three whole numbers" \
  box --cells 1,2.5,3 --size 1,1,1 --out c.msh
check short_size 2 "--size is '1,1'; it must be three positive numbers" \
  box --cells 1,1,1 --size 1,1 --out c.msh
check zero_size 2 'size along z is 0; it must be positive' \
  box --cells 1,1,1 --size 1,1,0 --out c.msh
check bad_origin 2 "--origin is '0,0,x'; it must be three numbers" \
  box --cells 1,1,1 --size 1,1,1 --origin 0,0,x --out c.msh
check missing_out 2 '--out is missing' box --cells 1,1,1 --size 1,1,1
check too_many_cells 2 'at most' box --cells 2000,2000,2000 --size 1,1,1 --out c.msh
check box_argument 2 "too many arguments: 'c.msh'" box --cells 1,1,1 --size 1,1,1 c.msh
check convert 0 'c.mesh: 5 nodes, 2 tets, 2 regions' convert "$meshes/two_regions.mesh" c.mesh
check flips_are_told 0 'c.node: 4 nodes, 1 tet, 1 region; 1 inverted tet flipped' \
  convert "$meshes/one_inverted_tet.mesh" c.node
check unused_nodes_are_told 0 '5 (1 used by no tet, the first is 4)' info "$meshes/unused_node.mesh"
check regions_are_told 0 'region 2      1 tet, 0.16666667 m^3' info c.mesh
check worst_is_placed 0 'worst tet      0, nodes 0 1 2 3, centre (0.25, 0.25, 0.25)' \
  info "$meshes/one_tet.mesh"
check bad_suffix 2 "the suffix '.stl' names no mesh format" convert bar.msh bar.stl
check one_file 2 'missing IN OUT' convert bar.msh
check no_folder 3 'no/such/bar.msh: cannot be written: there is no folder no/such' convert bar.msh no/such/bar.msh
check box_of_ten 0 'ten.msh: 75 nodes, 24 tets of ten nodes, 1 region' \
  box --cells 1,2,2 --size 1,2,2 --order 2 --out ten.msh
check ten_nodes 0 'tets           24 of ten nodes, 0 of them curved' info ten.msh
check ten_volume 0 'volume         4 m^3' info ten.msh
check lowered 0 'four.mesh: 18 nodes, 24 tets, 1 region' convert --order 1 ten.msh four.mesh
check raised 0 'ten.node: 75 nodes, 24 tets of ten nodes' convert --order 2 four.mesh ten.node
check kept 0 'ten.msh: 75 nodes, 24 tets of ten nodes' convert ten.node ten.msh
check curved 0 'tets           50 of ten nodes, 50 of them curved' info "$reference/ball_finer.msh"
check curved_volume 0 'volume         4.1505767 m^3' info "$reference/ball_finer.msh"
check scaled_jacobian 0 'scaled J       0.02036 at least, in tet 48' info "$reference/ball_finer.msh"
check refined 0 'fine.mesh: 2673 nodes, 12288 tets, 1 region' convert --refine 1 "$meshes/bar_16x4x4.mesh" fine.mesh
check refined_twice 0 'fine.mesh: 125 nodes, 384 tets, 1 region' convert --refine 2 "$meshes/cube_of_six_tets.mesh" fine.mesh
check refined_regions 0 'region 2      8 tets, 0.16666667 m^3' info fine_regions.mesh
check refined_order 0 'fine.mesh: 729 nodes, 384 tets of ten nodes, 1 region' convert --refine 2 --order 2 "$meshes/cube_of_six_tets.mesh" fine.mesh
check refined_curved 0 'tets           400 of ten nodes, 400 of them curved' info fine_ball.msh
check refined_curved_volume 0 'volume         4.1505767 m^3' info fine_ball.msh
check third_order 2 "--order is '3'; it must be 1 or 2" convert --order 3 ten.msh ten.node
check third_order_box 2 "--order is '3'; it must be 1 or 2" box --cells 1,1,1 --size 1,1,1 --order 3 --out no.msh
echo nonsense > bad.msh
check bad_mesh 3 "bad.msh:1: 'nonsense' begins no known mesh format" info bad.msh

# Commands that failed have left no file behind.
number=$((number + 1))
if [ "$(ls | tr '\n' ' ')" = 'b.ele b.node bad.msh bar.msh bar_parts box_parts c.ele c.mesh c.node fine.mesh fine_ball.msh fine_regions.mesh flat.msh flat.txt four.mesh out sets.mesh sets.msh ten.ele ten.msh ten.node torn.txt ' ]; then
  echo "ok $number - only_what_was_asked_for"
else
  echo "not ok $number - only_what_was_asked_for"
  ls | sed 's/^/# /'
fi
echo "1..$number"
