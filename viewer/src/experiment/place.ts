// Where pictures stand: one pixel of a picture is one pixel of the display, and the middle is the middle.

export interface Size {
  width: number;
  height: number;
}

/** CSS pixels. */
export interface Box extends Size {
  left: number;
  top: number;
}

const GAP_PX = 20;
/** Height of the buttons below; as much is left above, which keeps the pictures in the middle. */
const BELOW_PX = { beside: 150, alternating: 190 };
const BUTTONS_PX = 820;

/** Return the room that pictures of a size need in a layout, in CSS pixels. */
export function room(picture: Size, layout: keyof typeof BELOW_PX, ratio: number): Size {
  const across = layout === "beside" ? 3 : 1;
  return {
    width: Math.max(BUTTONS_PX, (across * picture.width + (across + 1) * GAP_PX) / ratio),
    height: picture.height / ratio + 2 * BELOW_PX[layout],
  };
}

/**
 * Return where a picture stands.
 *
 * `column` is -1, 0 or 1: left of the middle, in it, right of it. Sizes of pictures are in pixels of the
 * display; edges fall between these, so that nothing is resampled.
 */
export function place(picture: Size, column: number, window: Size, ratio: number): Box {
  const centre = (window.width * ratio) / 2 + column * (picture.width + GAP_PX);
  return {
    left: Math.round(centre - picture.width / 2) / ratio,
    top: Math.round((window.height * ratio - picture.height) / 2) / ratio,
    width: picture.width / ratio,
    height: picture.height / ratio,
  };
}
