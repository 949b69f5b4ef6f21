// node bundle.mjs PAGE.html PAGE.cpp: the page with its script and style inside, still without a map, as HTML to look
// into and as the source that the library is built of. Fetches nothing.
import { build } from 'esbuild';
import { readFile, writeFile } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';

const here = (name) => fileURLToPath(new URL(name, import.meta.url));
const [htmlFile, sourceFile] = process.argv.slice(2);

const bundled = async (entry) => {
  const result = await build({
    entryPoints: [here(entry)],
    bundle: true,
    minify: true,
    format: 'iife',
    target: 'es2022',
    charset: 'ascii',
    legalComments: 'inline',
    write: false,
    logLevel: 'warning',
  });
  return result.outputFiles[0].text;
};

/** Replaces a mark that must be in the text once; function, because a replacement's $ has a meaning. */
const filled = (text, mark, content) => {
  if (text.split(mark).length !== 2) throw new Error(`page.html must have ${mark} once`);
  return text.replace(mark, () => content);
};

const script = (await bundled('src/main.js')).replaceAll('</script', '<\\/script');
const style = await bundled('style.css');
let page = await readFile(here('page.html'), 'utf8');
page = filled(page, '/*octosurf:style*/', style);
page = filled(page, '/*octosurf:script*/', script);
if (page.split('<!--octosurf:map-->').length !== 2) throw new Error('page.html must have its mark for the map once');

const end = ')octosurf"';
if (page.includes(end)) throw new Error(`the page must not contain ${end}`);
const source = `#include "io/exporters/page_template.hpp"

std::string_view octosurf::io::page_template() {
  return R"octosurf(${page})octosurf";
}
`;
await writeFile(htmlFile, page);
await writeFile(sourceFile, source);
