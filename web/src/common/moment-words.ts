import type { Moment } from "../data/types";
import { jointWords, words } from "./names";

/** Joint that bears a body part, without its side. */
const JOINT_OF_PART: Readonly<Record<string, string>> = {
  "upper arm": "Shoulder",
  "lower arm": "Elbow",
  wrist: "Wrist",
  "forearm twist": "Elbow",
  trunk: "L5S1",
  neck: "T1C7",
};

/** A moment in two pieces: the part of the body, and what is the matter with it. */
export interface MomentWords {
  part: string;
  matter: string;
}

/**
 * Splits the service's sentence, which names score, action level and part itself: the list shows the
 * score beside it already, and the part in bold.
 */
export function momentWords(moment: Moment): MomentWords {
  const said = moment.reason ?? (moment.reasons ?? []).join("; ");
  const part = moment.body_part === "none" ? "" : (moment.body_part ?? "");
  let matter = said.replace(/^(RULA|REBA) \d+ \([^)]*\): /, "");
  if (part !== "" && matter.startsWith(`${part} `)) matter = matter.slice(part.length + 1);
  const named = /^j[A-Z]/.test(part) ? jointWords(part) : words(part);
  return { part: named || (moment.side ? words(moment.side) : ""), matter };
}

/** The joint to look at for a moment; null where the part has none. */
export function jointOfMoment(moment: Moment): string | null {
  if (moment.effort_joint) return moment.effort_joint;
  const part = (moment.body_part ?? "").replace(/^(right|left) /, "");
  const joint = JOINT_OF_PART[part];
  if (joint === undefined) return null;
  if (joint === "L5S1" || joint === "T1C7") return `j${joint}`;
  const side = /^(right|left) /.exec(moment.body_part ?? "")?.[1] ?? moment.side;
  if (side !== "right" && side !== "left") return null;
  return `j${side === "right" ? "Right" : "Left"}${joint}`;
}
