// SPDX-License-Identifier: Apache-2.0
// Which vertices are marked, with undo. A stroke is one step of undo, however many vertices it has.
export class Marks {
  readonly on: Uint8Array;
  count = 0;
  private stroke: number[] = [];          // vertices that this stroke has changed
  private done: number[][] = [];
  private undone: number[][] = [];

  constructor(vertices: number, first: ArrayLike<number>) {
    this.on = new Uint8Array(vertices);
    for (let i = 0; i < first.length; ++i) if (!this.on[first[i]]) this.flip(first[i]);
  }

  // Marks these vertices, or takes their marks away.
  put(vertices: Iterable<number>, marked: boolean): boolean {
    const before = this.stroke.length;
    for (const v of vertices)
      if (Boolean(this.on[v]) !== marked) {
        this.flip(v);
        this.stroke.push(v);
      }
    return this.stroke.length > before;
  }
  endStroke() {
    if (!this.stroke.length) return;
    this.done.push(this.stroke);
    this.stroke = [];
    this.undone = [];
  }
  // Takes back what the stroke has changed so far.
  dropStroke() {
    for (const v of this.stroke) this.flip(v);
    this.stroke = [];
  }
  undo() { this.back(this.done, this.undone); }
  redo() { this.back(this.undone, this.done); }
  get mayUndo() { return this.done.length > 0; }
  get mayRedo() { return this.undone.length > 0; }

  marked(): number[] {
    const all: number[] = [];
    this.on.forEach((m, v) => { if (m) all.push(v); });
    return all;
  }

  // A stroke changes a vertex once, so undoing it changes the same ones back.
  private back(from: number[][], to: number[][]) {
    this.endStroke();
    const stroke = from.pop();
    if (!stroke) return;
    for (const v of stroke) this.flip(v);
    to.push(stroke);
  }
  private flip(v: number) {
    this.on[v] ^= 1;
    this.count += this.on[v] ? 1 : -1;
  }
}
