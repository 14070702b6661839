import { describe, expect, it } from "vitest";

import type { Posture } from "../../src/data/types";
import { frameAt, mixOrientation } from "../../src/figure/interpolate";

const quarter = (angle: number) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];

const posture: Posture = {
  time_s: [0, 1, 3],
  joint_names: ["a", "b"],
  joint_position: [
    [0, 1],
    [1, 1],
    [1, 5],
  ],
  samples: [
    [
      [9, 9],
      [9, 9],
      [9, 9],
    ],
  ],
  base: {
    position_m: [
      [0, 0, 1],
      [1, 0, 1],
      [1, 2, 1],
    ],
    orientation_xyzw: [quarter(0), quarter(Math.PI / 2), quarter(Math.PI / 2).map((part) => -part)],
  },
};

describe("frameAt", () => {
  it("mixes angles and place between frames", () => {
    const frame = frameAt(posture, 2);
    expect([...frame.jointPosition]).toEqual([1, 3]);
    expect(frame.basePosition).toEqual([1, 1, 1]);
  });

  it("does not tumble where a quaternion changes sign", () => {
    const frame = frameAt(posture, 2);
    expect(Math.abs(frame.baseOrientation[3])).toBeCloseTo(Math.cos(Math.PI / 4));
    expect(Math.hypot(...frame.baseOrientation)).toBeCloseTo(1);
  });

  it("shows another sample on the same base", () => {
    const frame = frameAt(posture, 0.5, 0);
    expect([...frame.jointPosition]).toEqual([9, 9]);
    expect(frame.basePosition[0]).toBeCloseTo(0.5);
  });

  it("shows another sample on a base of its own, where feet stand and pelves move", () => {
    const base = {
      position_m: [
        [0, 0, 0.9],
        [0, 0, 0.7],
        [0, 0, 0.7],
      ],
      orientation_xyzw: posture.base.orientation_xyzw,
    };
    const moved = { ...posture, samples_base: [base] };
    expect(frameAt(moved, 0.5, 0).basePosition[2]).toBeCloseTo(0.8);
    expect(frameAt(moved, 0.5).basePosition[2]).toBeCloseTo(1);
  });

  it("leaves the posture it was given alone", () => {
    frameAt(posture, 0.5);
    expect(posture.joint_position[0]).toEqual([0, 1]);
  });
});

it("mixOrientation halves a turn", () => {
  const half = mixOrientation([quarter(0), quarter(1)], { index: 0, fraction: 0.5 });
  half.forEach((part, i) => expect(part).toBeCloseTo(quarter(0.5)[i]!));
});
