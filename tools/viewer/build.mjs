// Copies the page to a folder: the modules of src unchanged, and three.js from node_modules. Each
// file is also written as FILE.gz, for browsers that accept compressed files.
// usage: node build.mjs OUT NODE_MODULES
import { cpSync, mkdirSync, readdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import { dirname, extname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const [out, modules] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const three = join(modules, 'three');
mkdirSync(join(out, 'vendor'), { recursive: true });
cpSync(join(here, 'src'), out, { recursive: true });
for (const file of ['three.module.js', 'three.core.js']) cpSync(join(three, 'build', file), join(out, 'vendor', file));
cpSync(join(three, 'LICENSE'), join(out, 'vendor', 'three.LICENSE.txt'));

function pack(folder) {
  for (const name of readdirSync(folder)) {
    const path = join(folder, name);
    if (statSync(path).isDirectory()) pack(path);
    else if (['.js', '.css', '.html', '.svg', '.json'].includes(extname(name))) writeFileSync(`${path}.gz`, gzipSync(readFileSync(path), { level: 9 }));
  }
}
pack(out);
