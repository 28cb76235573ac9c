// SPDX-License-Identifier: Apache-2.0
// build.mjs OUT: live.html and report.html, each one file with everything in it.
import { build } from 'esbuild';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';

const out = process.argv[2] ?? 'out';
mkdirSync(out, { recursive: true });
const style = readFileSync('node_modules/uplot/dist/uPlot.min.css', 'utf8') +
  readFileSync('src/style.css', 'utf8');
for (const page of ['live', 'report']) {
  const bundle = await build({
    entryPoints: [`src/${page}.ts`], bundle: true, minify: true, write: false, format: 'iife',
    target: 'es2022', legalComments: 'none',
  });
  // Inside a page a script ends at the first closing tag, wherever it stands.
  const script = bundle.outputFiles[0].text.replaceAll('</script', '<\\/script');
  const html = readFileSync(`src/${page}.html`, 'utf8')
    .replace('/*style*/', () => style).replace('/*script*/', () => script);
  writeFileSync(join(out, `${page}.html`), html);
}
