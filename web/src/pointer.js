// Mouse, pen and fingers: what is a click, and what is hovered. Turning and moving are the controls' business.
const clickPixels = 6, clickMs = 600;

/** @param {import('./view.js').View} view @param {{hover: Function, leave: Function, click: Function}} calls */
export function bindPointer(view, { hover, leave, click }) {
  const { canvas } = view;
  let down = null, waiting = null;
  canvas.addEventListener('pointerdown', (event) => {
    down = event.isPrimary ? event : null;  // two fingers click nothing
  });
  canvas.addEventListener('click', ({ clientX: x, clientY: y, timeStamp }) => {
    if (down && Math.hypot(x - down.clientX, y - down.clientY) <= clickPixels && timeStamp - down.timeStamp <= clickMs) click(x, y);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (event.pointerType === 'touch' || event.buttons !== 0) return leave();
    // Once a frame at most: the search among a million voxels takes part of one.
    if (!waiting) {
      requestAnimationFrame(() => {
        if (waiting) hover(waiting.clientX, waiting.clientY);
        waiting = null;
      });
    }
    waiting = event;
    return undefined;
  });
  canvas.addEventListener('pointerleave', () => {
    waiting = null;
    leave();
  });
}
