/** The colours of values: from dark to bright, and for what may be negative from blue by grey to red. */

// Every 32nd of matplotlib's 256 entries, and the last; between them each is nearly straight.
/** viridis, which grows evenly brighter and is told apart by colour-blind eyes too. */
const SEQUENTIAL = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"];
/** Moreland's coolwarm of 2009, as matplotlib has it. */
const DIVERGING = ["3b4cc0", "6282ea", "8db0fe", "b9d0f9", "dddcdc", "f5c4ac", "f4987a", "dd5f4b", "b40426"];

/** Returns a row of 256 colours as RGBA bytes for each of the two. */
export function colourMaps(): Uint8Array {
  const bytes = new Uint8Array(2 * 4 * 256);
  [SEQUENTIAL, DIVERGING].forEach((anchors, row) => {
    const colours = anchors.map((hex) => [0, 2, 4].map((i) => Number.parseInt(hex.slice(i, i + 2), 16)));
    for (let i = 0; i < 256; i++) {
      const place = (i / 255) * (colours.length - 1);
      const low = Math.min(Math.floor(place), colours.length - 2);
      const at = 4 * (256 * row + i);
      for (let k = 0; k < 3; k++) {
        const [a, b] = [colours[low]![k]!, colours[low + 1]![k]!];
        bytes[at + k] = Math.round(a + (b - a) * (place - low));
      }
      bytes[at + 3] = 255;
    }
  });
  return bytes;
}

/** The same as a CSS gradient from left to right. */
export function cssGradient(diverging: boolean): string {
  const anchors = diverging ? DIVERGING : SEQUENTIAL;
  return `linear-gradient(to right, ${anchors.map((hex) => `#${hex}`).join(", ")})`;
}
