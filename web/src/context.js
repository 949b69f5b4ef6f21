// What every layer gets: the page's parts it may use.

/**
 * @typedef {object} Context
 * @property {import('./view.js').View} view
 * @property {import('three').Vector3} eye     in root coordinates, kept up to date
 * @property {import('three').Vector3} light   likewise
 * @property {{value: boolean}} cut            surfaces seen from behind are left out
 * @property {object?} before                  the map before this one in time, see data.js
 * @property {Settings} settings
 * @property {function(): number[]} ink        colour of lines that have no meaning of their own
 *
 * @typedef {object} Settings   what the reader has chosen; outlives a change of map
 * @property {Object<string, boolean>} on      layers
 * @property {Object<string, string>} choice   of a layer: what its colours say
 * @property {number?} sliceHeight             m, upright
 * @property {number[]?} up                    in the map frame; null: the map's own
 * @property {import('./clip.js').Clip} clip
 * @property {number} walkableDeg              a steeper surface's colour says that nothing walks there
 */
export {};
