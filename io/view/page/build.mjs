// SPDX-License-Identifier: Apache-2.0
// build.mjs OUT: live.html, report.html and pick.html, each one file with everything in it.
import { build } from 'esbuild';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

// Bundled packages keep their notices in the page, as their licences ask.
function notices(inputs) {
  const names = new Set(['uplot']);  // its style sheet is in every page
  for (const input of inputs) {
    const found = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input);
    if (found) names.add(found[1]);
  }
  return [...names].sort().map((name) => {
    const about = JSON.parse(readFileSync(`node_modules/${name}/package.json`, 'utf8'));
    const licence = readFileSync(`node_modules/${name}/LICENSE`, 'utf8').trim();
    return `${name} ${about.version}\n\n${licence}`.replaceAll('--', '- -');  // ends no comment
  }).join('\n\n');
}

const out = process.argv[2] ?? 'out';
mkdirSync(out, { recursive: true });
const style = readFileSync('node_modules/uplot/dist/uPlot.min.css', 'utf8') +
  readFileSync('src/style.css', 'utf8');
for (const page of ['live', 'report', 'pick']) {
  const bundle = await build({
    entryPoints: [`src/${page}.ts`], bundle: true, minify: true, write: false, format: 'iife',
    target: 'es2022', legalComments: 'none', metafile: true,
  });
  // Inside a page a script ends at the first closing tag, wherever it stands.
  const script = bundle.outputFiles[0].text.replaceAll('</script', '<\\/script');
  const html = readFileSync(`src/${page}.html`, 'utf8')
    .replace('/*style*/', () => style).replace('/*script*/', () => script)
    .replace('<html', () => `<!--\nThis page contains:\n\n${notices(Object.keys(bundle.metafile.inputs))}\n-->\n<html`);
  writeFileSync(join(out, `${page}.html`), html);
}
