/** Pan, zoom and pinch by mouse, touch and pen, the same by the keyboard, and drags that mean something else. */

export interface GestureTarget {
  /** Moves the picture by pixels of the page. */
  pan(dx: number, dy: number): void;
  /** Zooms by a factor about a place in the element. */
  zoom(factor: number, x: number, y: number): void;
  /** A drag that is not a pan (the light, the ruler): returns whether it is taken. */
  drag(phase: "start" | "move" | "end", x: number, y: number, event: PointerEvent): boolean;
  tap(x: number, y: number): void;
}

const CLICK_PX = 4;

export function attachGestures(element: HTMLElement, target: GestureTarget): void {
  const pointers = new Map<number, { x: number; y: number }>();
  let dragging = false;
  let moved = 0;
  let start = { x: 0, y: 0 };
  const place = (event: MouseEvent) => {
    const box = element.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  element.addEventListener("pointerdown", (event) => {
    if (event.button > 0) return;
    element.setPointerCapture(event.pointerId);
    const at = place(event);
    pointers.set(event.pointerId, at);
    if (pointers.size === 1) {
      moved = 0;
      start = at;
      dragging = target.drag("start", at.x, at.y, event);
    } else if (dragging) {
      dragging = false; // a second finger: a pinch
    }
  });
  element.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const at = place(event);
    moved = Math.max(moved, Math.hypot(at.x - start.x, at.y - start.y));
    if (dragging) {
      target.drag("move", at.x, at.y, event);
    } else if (pointers.size === 1) {
      target.pan(at.x - before.x, at.y - before.y);
    } else if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)![1];
      const spread = (p: typeof at) => Math.max(Math.hypot(p.x - other.x, p.y - other.y), 1);
      const [x, y] = [(at.x + other.x) / 2, (at.y + other.y) / 2];
      target.pan((at.x - before.x) / 2, (at.y - before.y) / 2);
      target.zoom(spread(at) / spread(before), x, y);
    }
    pointers.set(event.pointerId, at);
  });
  const end = (event: PointerEvent) => {
    if (!pointers.delete(event.pointerId)) return;
    const at = place(event);
    const wasDrag = dragging;
    if (dragging) target.drag("end", at.x, at.y, event);
    dragging = false;
    if (pointers.size > 0)
      moved = Number.POSITIVE_INFINITY; // the rest of a pinch is no click
    else if (event.type === "pointerup" && !wasDrag && moved < CLICK_PX) target.tap(at.x, at.y);
  };
  element.addEventListener("pointerup", end);
  element.addEventListener("pointercancel", end);
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const { x, y } = place(event);
      const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
      target.zoom(Math.exp(-event.deltaY * lines * (event.ctrlKey ? 0.01 : 0.002)), x, y);
    },
    { passive: false },
  );
  element.addEventListener("dblclick", (event) => {
    const { x, y } = place(event);
    target.zoom(event.shiftKey ? 0.5 : 2, x, y);
  });
}
