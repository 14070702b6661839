import type uPlot from "uplot";

import type { Shade } from "./chart-series";

const HATCH_PX = 7;

/** Hatches what is not known and greys what is doubtful, over the whole height of the plot. */
export function drawShades(u: uPlot, shades: readonly Shade[], hatch: string, grey: string): void {
  const pen = u.ctx;
  const { left, top, width, height } = u.bbox;
  const inside = (time: number) =>
    Math.min(left + width, Math.max(left, u.valToPos(time, "x", true)));
  for (const shade of shades) {
    const from = inside(shade.from);
    // A single frame is no wider than a hair; show it all the same.
    const across = Math.max(devicePixelRatio, inside(shade.to) - from);
    pen.save();
    pen.beginPath();
    pen.rect(from, top, across, height);
    if (shade.kind === "doubtful") {
      pen.fillStyle = grey;
      pen.fill();
    } else {
      pen.clip();
      pen.beginPath();
      const step = HATCH_PX * devicePixelRatio;
      // From a grid of the whole plot, so that neighbouring stretches are hatched as one.
      const first = left + Math.floor((from - height - left) / step) * step;
      for (let x = first; x < from + across; x += step) {
        pen.moveTo(x, top + height);
        pen.lineTo(x + height, top);
      }
      pen.strokeStyle = hatch;
      pen.lineWidth = 1.5 * devicePixelRatio;
      pen.stroke();
    }
    pen.restore();
  }
}
