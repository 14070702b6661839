import type { Posture } from "../data/types";
import { type TimePlace, placeOf } from "../common/time-lookup";

/** A whole-body posture at one instant. */
export interface Frame {
  jointPosition: Float64Array;
  basePosition: [number, number, number];
  /** xyzw, of unit length. */
  baseOrientation: [number, number, number, number];
}

/** Linear mix of two rows. */
export function mixRows(rows: readonly ArrayLike<number>[], place: TimePlace): Float64Array {
  const here = Float64Array.from(rows[place.index]!);
  if (place.fraction === 0) return here;
  const next = rows[place.index + 1]!;
  for (let i = 0; i < here.length; i++) here[i]! += place.fraction * (next[i]! - here[i]!);
  return here;
}

/** Mix of two close rotations along the shorter way, made unit again. */
export function mixOrientation(
  rows: readonly ArrayLike<number>[],
  place: TimePlace,
): [number, number, number, number] {
  const here = rows[place.index]!;
  const next = rows[Math.min(place.index + 1, rows.length - 1)]!;
  let dot = 0;
  for (let i = 0; i < 4; i++) dot += here[i]! * next[i]!;
  // q and -q are one rotation; mixing across the sign would tumble the body.
  const sign = dot < 0 ? -1 : 1;
  const mixed = [0, 1, 2, 3].map(
    (i) => (1 - place.fraction) * here[i]! + place.fraction * sign * next[i]!,
  );
  const norm = Math.hypot(...mixed) || 1;
  return mixed.map((part) => part / norm) as [number, number, number, number];
}

/**
 * The posture at a time, between frames where it falls between them.
 *
 * @param sample Index of a sample of the prediction; the representative one if not given.
 */
export function frameAt(posture: Posture, time: number, sample?: number): Frame {
  const place = placeOf(posture.time_s, time);
  const rows = sample === undefined ? posture.joint_position : posture.samples![sample]!;
  const base = (sample === undefined ? null : posture.samples_base?.[sample]) ?? posture.base;
  return {
    jointPosition: mixRows(rows, place),
    basePosition: [...mixRows(base.position_m, place)] as [number, number, number],
    baseOrientation: mixOrientation(base.orientation_xyzw, place),
  };
}
