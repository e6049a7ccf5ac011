/** What the keys do while the picture has the focus. */

export interface KeyTarget {
  pan(dx: number, dy: number): void;
  zoom(factor: number, x: number, y: number): void;
  /** Shows all of the picture, or its full size. */
  showAll(): void;
  showFullSize(): void;
  tap(x: number, y: number): void;
}

/** Does what a key asks for, in pixels of the page; `middle` is the middle of the picture. */
export function pressed(event: KeyboardEvent, target: KeyTarget, middle: [number, number]): void {
  if (event.ctrlKey || event.metaKey) return;
  const step = event.shiftKey ? 200 : 50;
  const actions: Record<string, () => void> = {
    ArrowLeft: () => target.pan(step, 0),
    ArrowRight: () => target.pan(-step, 0),
    ArrowUp: () => target.pan(0, step),
    ArrowDown: () => target.pan(0, -step),
    "+": () => target.zoom(1.25, ...middle),
    "=": () => target.zoom(1.25, ...middle),
    "-": () => target.zoom(0.8, ...middle),
    "0": () => target.showAll(),
    "1": () => target.showFullSize(),
    i: () => target.tap(...middle),
  };
  const action = actions[event.key];
  if (!action) return;
  event.preventDefault();
  action();
}
