// Mouse, pen and fingers: what is a click, and what is hovered. Turning and moving are the controls' business.
const clickPixels = 6, clickMs = 600;

/** @param {import('./view.js').View} view @param {{hover: Function, leave: Function, click: Function}} calls */
export function bindPointer(view, { hover, leave, click }) {
  const { canvas } = view;
  let down = null, pointers = 0, waiting = null;
  canvas.addEventListener('pointerdown', (event) => {
    ++pointers;
    down = pointers === 1 && event.button === 0 ? { x: event.clientX, y: event.clientY, at: performance.now() } : null;
    canvas.focus({ preventScroll: true });
  });
  const up = () => { pointers = Math.max(0, pointers - 1); };
  window.addEventListener('pointercancel', up);
  window.addEventListener('pointerup', (event) => {
    up();
    const way = down && Math.hypot(event.clientX - down.x, event.clientY - down.y);
    if (down && way <= clickPixels && performance.now() - down.at <= clickMs) click(event.clientX, event.clientY);
    down = null;
  });
  canvas.addEventListener('pointermove', (event) => {
    if (event.pointerType === 'touch' || event.buttons !== 0) return leave();
    // Once a frame at most: the search among a million voxels takes part of one.
    if (!waiting) {
      requestAnimationFrame(() => {
        if (waiting) hover(waiting.x, waiting.y);
        waiting = null;
      });
    }
    waiting = { x: event.clientX, y: event.clientY };
    return undefined;
  });
  canvas.addEventListener('pointerleave', () => {
    waiting = null;
    leave();
  });
}
