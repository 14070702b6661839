import { describe, expect, it } from "vitest";

import { type Rgb, lightness, rampColour, rampGradient } from "../../src/common/colour-ramp";

/** How a colour looks to a dichromat (Viénot, Brettel and Mollon 1999), linear-light matrices. */
const DICHROMATS: Record<string, number[][]> = {
  protan: [
    [0.1124, 0.8876, 0],
    [0.1124, 0.8876, 0],
    [0.004, -0.004, 1],
  ],
  deutan: [
    [0.2928, 0.7072, 0],
    [0.2928, 0.7072, 0],
    [-0.0223, 0.0223, 1],
  ],
};

function seenBy(matrix: number[][], colour: Rgb): Rgb {
  const linear = colour.map((c) =>
    c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4,
  );
  return matrix.map((row) => {
    const light = Math.min(
      1,
      Math.max(
        0,
        row.reduce((sum, m, i) => sum + m * linear[i]!, 0),
      ),
    );
    return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);
  }) as unknown as Rgb;
}

const STEPS = Array.from({ length: 41 }, (_, i) => i / 40);

describe("rampColour", () => {
  it("darkens at every step, so that order survives a grey print", () => {
    const light = STEPS.map((step) => lightness(rampColour(step)));
    for (let i = 1; i < light.length; i++) expect(light[i]!).toBeLessThan(light[i - 1]!);
    expect(light[0]! - light[40]!).toBeGreaterThan(60);
  });

  it.each(Object.keys(DICHROMATS))("darkens at every step to a %s eye", (kind) => {
    const light = STEPS.map((step) => lightness(seenBy(DICHROMATS[kind]!, rampColour(step))));
    for (let i = 1; i < light.length; i++) expect(light[i]!).toBeLessThan(light[i - 1]! + 1e-9);
  });

  it("clamps what lies outside the scale", () => {
    expect(rampColour(-1)).toEqual(rampColour(0));
    expect(rampColour(7)).toEqual(rampColour(1));
  });

  it("is what the legend shows at both ends", () => {
    const gradient = rampGradient();
    expect(gradient).toContain(`rgb(${rampColour(0).join(" ")})`);
    expect(gradient).toContain(`rgb(${rampColour(1).join(" ")})`);
  });
});
