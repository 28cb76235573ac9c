// SPDX-License-Identifier: Apache-2.0
// Strips over time, as in the paper's Fig. 10: contacts, force, torque, penetration depth.
import uPlot from 'uplot';
import { css, onTheme, series as colours } from './colours';

export interface StripSpec {
  title: string;
  column: number;  // of a row: time, contacts, force, torque, depth, frame time
  line?: number;   // a level that gets a dashed line
}

export const specs: StripSpec[] = [
  { title: 'contacts', column: 1 },
  { title: 'force [N]', column: 2 },
  { title: 'torque [mN·m]', column: 3 },
  { title: 'depth [voxel], limit 0.5', column: 4, line: 0.5 },
];

// Rows of `width` numbers, time first.
export class Strips {
  private plots: uPlot[] = [];
  private marker = Number.NaN;
  private flags: { time: number; colour: string }[] = [];

  // `height` of one strip with its title and axes [pixels]; null: they share the height of `where`.
  constructor(private where: HTMLElement, labels: string[], private height: number | null,
              private onTime?: (time: number) => void) {
    const sync = uPlot.sync('strips');
    const ink = { stroke: () => css('muted'), grid: { stroke: () => css('grid') }, ticks: { stroke: () => css('grid'), size: 4 }, font: '11px system-ui, sans-serif' };
    for (const spec of specs) {
      const plot = new uPlot({
        title: spec.title, ...this.size(), legend: { show: false },
        cursor: { sync: { key: sync.key }, y: false, drag: { x: false, y: false } },
        scales: { x: { time: false }, y: { range: (_u, _low, high) => [0, Math.max(high * 1.08, spec.line ? 2 * spec.line : 1e-3)] } },
        axes: [{ ...ink, size: 22, space: 44, gap: 3, values: (_u, marks) => marks.map((m) => `${+m.toFixed(3)} s`) },
               { ...ink, size: 44, space: 22, gap: 3 }],
        series: [{}, ...labels.map((label, i) => ({
          label, stroke: colours[i % colours.length], width: 1.6, points: { show: false },
        }))],
        hooks: { draw: [(u: uPlot) => this.lines(u, spec)] },
      }, [[], ...labels.map(() => [])] as uPlot.AlignedData, where);
      if (onTime) plot.over.addEventListener('click', () => {
        const at = plot.posToVal(plot.cursor.left ?? 0, 'x');
        if (Number.isFinite(at)) this.onTime?.(at);
      });
      this.plots.push(plot);
    }
    new ResizeObserver(() => this.plots.forEach((p) => p.setSize(this.size()))).observe(where);
    onTheme(() => this.plots.forEach((p) => p.redraw(false)));
  }

  // One table of rows for each label; tables with other times are joined.
  show(tables: { rows: Float32Array; width: number }[]) {
    const joined = tables.length === 1 ? null : tables;
    specs.forEach((spec, i) => {
      const data = (joined ?? tables).map(({ rows, width }) => {
        const n = Math.floor(rows.length / width);
        const t = new Float64Array(n), y = new Float64Array(n);
        for (let k = 0; k < n; ++k) {
          t[k] = rows[k * width];
          y[k] = rows[k * width + spec.column];
        }
        return [t, y] as unknown as uPlot.AlignedData;
      });
      this.plots[i].setData(data.length === 1 ? data[0] : uPlot.join(data));
    });
  }

  mark(time: number) {
    this.marker = time;
    this.plots.forEach((p) => p.redraw(false));
  }

  // Times that stay marked.
  flag(flags: { time: number; colour: string }[]) {
    this.flags = flags;
    this.plots.forEach((p) => p.redraw(false));
  }

  // Of one plot in the grid. uPlot does not count its title.
  private size() {
    const columns = getComputedStyle(this.where).gridTemplateColumns.split(' ').length;
    const rows = Math.ceil(specs.length / columns);
    const title = 1.6 * parseFloat(getComputedStyle(document.documentElement).fontSize);
    return {
      width: Math.max(120, Math.floor(this.where.clientWidth / columns) - 4),
      height: Math.max(60, (this.height ?? Math.floor(this.where.clientHeight / rows)) - title - 4),
    };
  }

  private lines(u: uPlot, spec: StripSpec) {
    const g = u.ctx, { left, top, width, height } = u.bbox;
    g.save();
    if (spec.line !== undefined) {
      const y = u.valToPos(spec.line, 'y', true);
      g.strokeStyle = css('limit');
      g.setLineDash([6, 4]);
      g.beginPath();
      g.moveTo(left, y);
      g.lineTo(left + width, y);
      g.stroke();
    }
    const upright = (time: number, colour: string, dash: number[]) => {
      const x = Number.isFinite(time) ? u.valToPos(time, 'x', true) : -1;
      if (x < left || x > left + width) return;
      g.strokeStyle = colour;
      g.setLineDash(dash);
      g.beginPath();
      g.moveTo(x, top);
      g.lineTo(x, top + height);
      g.stroke();
    };
    for (const flag of this.flags) upright(flag.time, flag.colour, [3, 3]);
    upright(this.marker, css('marker'), []);
    g.restore();
  }
}
