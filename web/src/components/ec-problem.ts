import { LitElement, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { anything } from "../common/format";
import { sharedStyles } from "../common/shared-styles";
import type { Problem } from "../data/types";

const SHOWN = 8;

/** What went wrong, where, what was expected and what was got. */
@customElement("ec-problem")
export class EcProblem extends LitElement {
  @property({ attribute: false }) problem: Problem | null = null;

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
        background: var(--bad-soft);
        border-left: 3px solid var(--bad);
        border-radius: 6px;
        padding: 0.6rem 0.8rem;
        overflow-wrap: anywhere;
      }
      b {
        color: var(--bad);
        font-weight: 620;
      }
      li {
        margin-top: 0.4rem;
      }
      code {
        font-size: 0.86rem;
      }
    `,
  ];

  override render() {
    const problem = this.problem;
    if (!problem) return nothing;
    const items = problem.errors ?? [];
    return html`
      <div role="alert">
        <b>${problem.title}</b>
        ${problem.detail ? html`<p>${problem.detail}</p>` : nothing}
        ${
          items.length > 0
            ? html`<ul class="small">
                ${items
                  .slice(0, SHOWN)
                  .map(
                    (item) =>
                      html`<li>
                        ${item.pointer ? html`<code>${item.pointer}</code> ` : nothing}${item.detail}
                        ${
                          item.expected !== undefined && item.expected !== null
                            ? html`<span class="soft"
                                >Expected ${anything(item.expected)}, got
                                ${anything(item.got)}.</span
                              >`
                            : nothing
                        }
                      </li>`,
                  )}
                ${items.length > SHOWN ? html`<li>and ${items.length - SHOWN} more</li>` : nothing}
              </ul>`
            : nothing
        }
      </div>
    `;
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-problem": EcProblem;
  }
}
