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
/** Room for the buttons below, and as much above, which keeps the pictures in the middle. */
const BELOW_PX = 150;

/** Return the room that pictures of a size need, in CSS pixels, for `across` of them side by side. */
export function room(picture: Size, across: number, ratio: number): Size {
  return {
    width: (across * picture.width + (across + 1) * GAP_PX) / ratio,
    height: picture.height / ratio + 2 * BELOW_PX,
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
