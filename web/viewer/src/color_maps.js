// Maps of colors for the picture in 3D, in which equal steps of values look about equally large, also for people with color
// blindness: viridis and inferno by Stéfan van der Walt and Nathaniel Smith (2015, CC0), cividis by Jamie Nuñez, Christopher
// Anderton and Ryan Renslow (PLOS ONE, 2018). Colors at equal distances, between which the map is linear.
const stops = {
  grey: "000000 ffffff",
  viridis: "440154 482576 414487 35608d 2a788e 21908c 22a884 43bf71 7ad151 bbdf27 fde725",
  cividis: "00204d 00306f 2a406c 48526b 5e626e 727374 878479 9e9677 b6a971 d0be67 ead357 ffea46",
  inferno: "000004 160b39 420a68 6a176e 932667 bc3754 dd513a f37819 fca50a f6d746 fcffa4",
};

export const mapNames = Object.keys(stops);

/** The color of a share from 0 to 1: red, green and blue, from 0 to 255. */
export function colorIn(name, share) {
  const colors = stops[name].split(" ").map((text) => [0, 2, 4].map((i) => Number.parseInt(text.slice(i, i + 2), 16)));
  const at = Math.min(Math.max(share, 0), 1) * (colors.length - 1);
  const below = Math.min(Math.floor(at), colors.length - 2);
  return colors[below].map((n, i) => n + (at - below) * (colors[below + 1][i] - n));
}

/** A map as `count` pixels, RGBA. */
export const mapPixels = (name, count) =>
  Uint8Array.from(Array.from({ length: count }, (_, i) => [...colorIn(name, i / (count - 1)).map(Math.round), 255]).flat());
