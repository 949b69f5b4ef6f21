// What the reader takes out of the page: files.
import { hasServer } from './server.js';

function download(name, blob) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

const fileName = (map, ending) => `${map.name.replaceAll(/[^\p{L}\p{N}._-]+/gu, '_')}.${ending}`;

/** As octosurf export writes them, a surface a line. */
function surfacesJson({ resolution, revision, surfaces, cylinders }) {
  const lines = (all) => `[\n${all.map(({ exported }) => JSON.stringify(exported)).join(',\n')}\n]`;
  const head = JSON.stringify({ format: 'octosurf-surfaces', version: 1, resolution, revision });
  return `${head.slice(0, -1)},"surfaces":${lines(surfaces)},"cylinders":${lines(cylinders)}}\n`;
}

/** The server's own export, while it answers; else what the page has. */
async function surfacesOf(map) {
  if (hasServer()) {
    const reply = await fetch('/api/surfaces').catch(() => null);
    if (reply?.ok) return reply.blob();
  }
  return new Blob([surfacesJson(map)], { type: 'application/json' });
}

export async function saveSurfaces(map) {
  download(fileName(map, 'json'), await surfacesOf(map));
}

/** @param {import('./view.js').View} view */
export function savePicture(map, view) {
  view.draw();
  view.canvas.toBlob((blob) => download(fileName(map, 'png'), blob), 'image/png');
}
