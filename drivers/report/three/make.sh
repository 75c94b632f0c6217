#!/bin/sh
# make.sh: makes three.min.js and LICENSE again, byte for byte, from the npm packages named here. Only needed for
# another version; the build of flesh needs neither node nor npm.
set -eu
here=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --no-audit --no-fund --ignore-scripts three@0.187.0 esbuild@0.28.2
cp "$here/names.js" .
node_modules/.bin/esbuild names.js --bundle --minify --format=iife --global-name=THREE --target=es2020 \
  --legal-comments=inline --outfile=three.min.js
cp three.min.js "$here/three.min.js"
cp node_modules/three/LICENSE "$here/LICENSE"
