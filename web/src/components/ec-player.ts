import { LitElement, css, html, nothing } from "lit";
import { customElement, property, query, state } from "lit/decorators.js";

import { rampGradient } from "../common/colour-ramp";
import { figure } from "../common/format";
import { jointWords } from "../common/names";
import type { Playback } from "../common/playback";
import { sharedStyles } from "../common/shared-styles";
import type { Posture } from "../data/types";
import "./ec-figure";
import type { EcFigure } from "./ec-figure";
import "./ec-transport";

/** The body, its legend and its transport in one card. */
@customElement("ec-player")
export class EcPlayer extends LitElement {
  @property({ attribute: false }) urdf = "";
  @property({ attribute: false }) posture: Posture | null = null;
  @property({ attribute: false }) playback: Playback | null = null;
  @property() joint: string | null = null;
  @property() hand: "right" | "left" = "right";
  @property({ type: Boolean }) busy = false;

  @state() private spread = false;
  @query("ec-figure") readonly figure!: EcFigure;

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: flex;
        flex-direction: column;
        overflow: hidden;
        min-height: 0;
      }
      .view {
        position: relative;
        flex: 1;
        min-height: 260px;
      }
      ec-figure {
        position: absolute;
        inset: 0;
      }
      .legend,
      .options {
        position: absolute;
        left: 0.7rem;
        font-size: 0.79rem;
      }
      .legend {
        top: 0.7rem;
        width: 9.2rem;
      }
      .bar {
        height: 8px;
        border-radius: 4px;
        margin: 0.25rem 0 0.15rem;
      }
      .ends {
        display: flex;
        justify-content: space-between;
      }
      .options {
        bottom: 0.55rem;
        display: flex;
        gap: 0.9rem;
        align-items: center;
      }
      .options label {
        display: flex;
        gap: 0.35rem;
        align-items: center;
        cursor: pointer;
      }
      .options input {
        accent-color: var(--accent);
        margin: 0;
      }
      .options button {
        border: none;
        background: none;
        padding: 0;
        min-height: 0;
        color: var(--ink-soft);
        text-decoration: underline;
        text-underline-offset: 2px;
      }
      .key::before {
        content: "";
        display: inline-block;
        width: 1rem;
        height: 3px;
        border-radius: 2px;
        background: var(--accent);
        margin-right: 0.35rem;
        vertical-align: middle;
      }
      ec-transport {
        padding: 0.5rem 0.8rem;
        border-top: 1px solid var(--line);
      }
      .busy {
        position: absolute;
        right: 0.7rem;
        top: 0.6rem;
      }
    `,
  ];

  override render() {
    const samples = this.posture?.samples?.length ?? 0;
    return html`
      <div class="view">
        <ec-figure
          .urdf=${this.urdf}
          .posture=${this.posture}
          .playback=${this.playback}
          .joint=${this.joint}
          .hand=${this.hand}
          ?spread=${this.spread}
        ></ec-figure>
        ${this.#legend()}
        <div class="options">
          ${
            samples > 0
              ? html`<label title="Other postures the model holds likely for the same hand path">
                  <input
                    type="checkbox"
                    .checked=${this.spread}
                    @change=${(event: Event) => {
                      this.spread = (event.target as HTMLInputElement).checked;
                    }}
                  />
                  Spread (${samples} samples)
                </label>`
              : nothing
          }
          <button @click=${() => this.figure.resetView()}>Reset view</button>
          ${this.posture?.target?.position_m.length ? html`<span class="key soft">Hand path</span>` : nothing}
        </div>
        ${this.busy ? html`<span class="busy tag">Loading…</span>` : nothing}
      </div>
      <ec-transport .playback=${this.playback}></ec-transport>
    `;
  }

  #legend() {
    const scales = this.posture?.effort_scale_nm;
    if (!scales || Object.keys(scales).length === 0) return nothing;
    const values = Object.values(scales);
    const shared = Math.max(...values) - Math.min(...values) < 1e-9;
    const joint = this.joint !== null && this.joint in scales ? this.joint : null;
    const top = shared ? values[0]! : joint ? scales[joint]! : null;
    return html`
      <div class="legend number">
        <div>Joint effort, N·m</div>
        <div class="bar" .style=${`background: ${rampGradient()}`}></div>
        <div class="ends soft">
          <span>0</span>
          <span>${top === null ? "its largest" : figure(top)}</span>
        </div>
        ${
          shared || !joint
            ? nothing
            : html`<div class="soft">for ${jointWords(joint)}; each joint has its own scale</div>`
        }
      </div>
    `;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-player": EcPlayer;
  }
}
