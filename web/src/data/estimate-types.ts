/** What the service sends and takes of estimates, in its own spelling. */

/** A quantity with its 5, 50 and 95 % quantile; null where there are no bands. */
export interface Quantiles {
  p05: number | null;
  p50: number;
  p95: number | null;
}

export type HandState = "free" | "loaded" | "unknown";

/** A stretch in which the hands' state does not change. */
export interface Hold {
  start_s: number;
  end_s: number;
  state: HandState;
  /** Hands that may bear: the mass is their sum. */
  hands: string[];
  mass_kg: Quantiles;
  by_definition_kg: Record<string, Quantiles>;
  /** Each hand's part, or null where only the sum can be told. */
  split_kg: Record<string, number> | null;
}

export interface PeakEffort {
  joint: string;
  peak_nm: Quantiles;
  at_s: number;
  median_nm: number;
  p90_nm: number;
  known_share: number;
}

export interface HandsStretch {
  start_s: number;
  end_s: number;
  right: HandState;
  left: HandState;
  together: HandState;
}

export interface LowBack {
  peak_force_n: number;
  peak_force_sd_n: number | null;
  peak_force_at_s: number;
  peak_moment_nm: number;
  peak_moment_sd_nm: number | null;
  peak_moment_at_s: number;
  known_share: number;
}

export interface PlateStance {
  plate: string;
  foot: string;
  start_s: number;
  end_s: number;
  given: boolean;
}

export interface EstimateSummary {
  id: string;
  recording_id: string;
  source: string;
  created: string;
  options: Record<string, unknown>;
  person: {
    height_m: number;
    mass_kg: number;
    mass_from: string;
    sex: string;
    model_mass_kg: number;
  };
  duration_s: number;
  frames: number;
  rate_hz: number;
  /** Reason to frames that could not be estimated. */
  left_out: Record<string, number>;
  bands: string;
  payload: {
    definition: string;
    free_hands: string[];
    known_share: number;
    max_kg: (Quantiles & { at_s: number }) | null;
    /** What the plates bear beyond the body, over the frames. */
    plates_minus_model_kg: Quantiles | null;
  };
  holds: Hold[];
  hands: HandsStretch[];
  balance: {
    share: Record<string, number>;
    stretches: { start_s: number; end_s: number; state: string }[];
  };
  /** Greatest first. */
  efforts: PeakEffort[];
  low_back: LowBack | null;
  feet: {
    plates_from: string;
    clock: { offset_s: number; sd_s: number | null; from: string } | null;
    stances: PlateStance[];
  } | null;
  fit: Record<string, unknown>;
  assumed: string[];
  findings: string[];
  files: { role: string; name: string; sha256: string }[];
  columns: string[];
  model_urdf_url: string;
}

export interface EstimateItem {
  id: string;
  source: string;
  created: string;
  duration_s: number;
}

/** What can be asked; what is left out is assumed and named. */
export interface EstimateOptions {
  height_m: number;
  mass_kg?: number;
  sex?: string;
  hands?: string;
  definition?: string;
  bands?: string;
  tare_s?: [number, number];
  clock_offset_s?: number;
  accept?: string[];
}

export interface EstimateRequest extends EstimateOptions {
  recording_id: string;
}

export interface SeriesPart {
  columns: Record<string, (number | boolean | string | null)[]>;
  units: Record<string, string>;
}
