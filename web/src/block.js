// A message about a map as src/io/exporters/page_messages.hpp packs it: gzip of a JSON document and arrays of numbers.

const arrayTypes = {
  u8: Uint8Array, u16: Uint16Array, u32: Uint32Array,
  i8: Int8Array, i16: Int16Array, i32: Int32Array,
};

/** @param {string} text @returns {Uint8Array} */
function bytesOfBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < characters.length; ++i) bytes[i] = characters.charCodeAt(i);
  return bytes;
}

/** @param {string} text base64, as it stands in a page */
export const readTextBlock = (text) => readBlock(bytesOfBase64(text.trim()));

/**
 * @param {BufferSource} bytes
 * @returns {Promise<{json: object, arrays: Object<string, ArrayLike<number>>}>}
 */
export async function readBlock(bytes) {
  const packed = new Blob([bytes]).stream();
  const buffer = await new Response(packed.pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  for (const [name, [type, at, count]] of Object.entries(json.arrays ?? {}))
    arrays[name] = new arrayTypes[type](buffer, 4 + length + at, count);
  return { json, arrays };
}

/**
 * Undoes differences() of page.cpp in place; the array's own type does the modulo.
 * @template {Uint8Array|Uint16Array|Uint32Array|Int32Array} A
 * @param {A} numbers @returns {A}
 */
export function summed(numbers) {
  for (let i = 1; i < numbers.length; ++i) numbers[i] += numbers[i - 1];
  return numbers;
}
