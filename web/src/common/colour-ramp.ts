/**
 * The ramp of joint effort: pale to dark through amber and red.
 *
 * Lightness falls steadily from end to end, so that order survives every kind of colour blindness
 * and a grey print; a test checks that. Zero is close to the body's own grey: what bears nothing
 * does not call for attention.
 */
export type Rgb = readonly [number, number, number];

const STOPS: readonly Rgb[] = [
  [250, 236, 190],
  [253, 205, 110],
  [250, 160, 62],
  [232, 104, 42],
  [196, 52, 38],
  [128, 16, 38],
];

/** Colour of a fraction of the scale, 0 to 1 (clamped), each channel 0 to 255. */
export function rampColour(fraction: number): Rgb {
  const position = Math.min(1, Math.max(0, fraction)) * (STOPS.length - 1);
  const index = Math.min(STOPS.length - 2, Math.floor(position));
  const along = position - index;
  const from = STOPS[index]!;
  const to = STOPS[index + 1]!;
  const mix = (channel: 0 | 1 | 2) =>
    Math.round(from[channel] + along * (to[channel] - from[channel]));
  return [mix(0), mix(1), mix(2)];
}

export const cssColour = ([r, g, b]: Rgb): string => `rgb(${r} ${g} ${b})`;

/** The whole ramp as a CSS gradient, low end first. */
export function rampGradient(direction = "to right"): string {
  return `linear-gradient(${direction}, ${STOPS.map(cssColour).join(", ")})`;
}

/** CIE lightness L* of an sRGB colour, 0 to 100. */
export function lightness(colour: Rgb): number {
  const linear = colour.map((channel) => {
    const c = channel / 255;
    return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
  });
  const y = 0.2126 * linear[0]! + 0.7152 * linear[1]! + 0.0722 * linear[2]!;
  return y > 0.008856 ? 116 * Math.cbrt(y) - 16 : 903.3 * y;
}
