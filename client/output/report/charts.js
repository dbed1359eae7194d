
// Numbers for people: 1,234, 0.0567, 1.2e+9.
function shown(value, digits = 4) {
  if (value === null || !Number.isFinite(value)) return '-';
  const size = Math.abs(value);
  if (size >= 1e9 || (size < 1e-4 && size > 0)) return value.toExponential(digits - 1);
  if (Number.isInteger(value)) return value.toLocaleString('en');
  return value.toLocaleString('en', {maximumSignificantDigits: Math.max(digits, Math.ceil(Math.log10(size + 1)))});
}

// Durations keep their zeros, so that columns of them do not jump while playing.
function shownMs(value) {
  if (value === null || !Number.isFinite(value)) return '-';
  return value >= 100 || value === 0 ? value.toFixed(0) : value < 0.01 ? value.toFixed(4) : value.toPrecision(3);
}

// About `wanted` round numbers from `low` to `high`.
function ticksOf(low, high, wanted) {
  const rough = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9) + 0; k * step <= high + 1e-9 * step; ++k) ticks.push(k * step + 0);
  return ticks;
}

// A curve or a stack of bands over the frames, with a cursor at the current frame.
class Chart {
  // options: series [{name, color, values}], stacked, fromZero, format, caption(position), pick
  constructor(figure, labels, options) {
    this.labels = labels;
    this.options = options;
    this.current = 0;
    this.caption = figure.querySelector('figcaption').appendChild(document.createElement('span'));
    const namespace = document.getElementById('picture').namespaceURI;
    this.make = (name) => document.createElementNS(namespace, name);
    this.svg = figure.appendChild(this.make('svg'));
    this.svg.setAttribute('class', 'chart');
    this.legend = figure.appendChild(document.createElement('ul'));
    this.legend.className = 'legend';
    this.values = options.series.map((series) => {
      const item = this.legend.appendChild(document.createElement('li'));
      item.appendChild(document.createElement('i')).style.background = series.color;
      item.append(series.name + ' ');
      return item.appendChild(document.createElement('b'));
    });
    this.range();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.svg);
  }

  range() {
    const {series, stacked, fromZero} = this.options;
    this.tops = series.map((one) => one.values.slice());
    if (stacked) {
      for (let s = 1; s < series.length; ++s) {
        this.tops[s] = series[s].values.map((value, k) => value + this.tops[s - 1][k]);
      }
    }
    const all = (stacked ? this.tops.at(-1) : this.tops.flat())
        .filter(Number.isFinite).sort((a, b) => a - b);
    const peak = all.at(-1) ?? 1;
    // One slow frame, usually the first, must not flatten all others.
    const usual = (all[Math.floor(0.97 * (all.length - 1))] ?? 1) * 1.3;
    this.clipped = stacked && peak > 2 * usual && all.length > 10;
    let high = this.clipped ? usual : peak;
    let low = fromZero ? 0 : all[0] ?? 0;
    if (!fromZero) {
      const margin = Math.max(0.08 * (high - low), 0.002 * Math.abs(high), 1e-300);
      low -= margin;
      high += margin;
    }
    if (!(high > low)) high = low + 1;
    this.low = low;
    this.high = fromZero ? high * 1.05 : high;
    this.peak = peak;
  }

  x(position) {
    const steps = this.labels.length - 1;
    return this.left + (steps === 0 ? 0.5 : position / steps) * this.innerWidth;
  }

  y(value) {
    const share = (value - this.low) / (this.high - this.low);
    return this.top + (1 - Math.min(share, 1)) * this.innerHeight;
  }

  add(name, attributes, text) {
    const element = this.svg.appendChild(this.make(name));
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    return element;
  }

  draw() {
    const width = this.svg.clientWidth;
    const height = this.svg.clientHeight;
    if (width === 0 || this.labels.length === 0) return;
    this.svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    this.svg.replaceChildren();
    const ticks = ticksOf(this.low, this.high, 5);
    const texts = ticks.map((tick) => shown(tick, 5));
    this.left = 10 + 6.4 * Math.max(...texts.map((text) => text.length));
    this.top = 8;
    this.innerWidth = width - this.left - 8;
    this.innerHeight = height - this.top - 22;
    ticks.forEach((tick, k) => {
      const y = this.y(tick);
      this.add('line', {class: 'rule', x1: this.left, x2: width - 8, y1: y, y2: y});
      this.add('text', {x: this.left - 6, y: y + 4, 'text-anchor': 'end'}, texts[k]);
    });
    this.drawFrameAxis(height);
    this.drawSeries();
    if (this.clipped) {
      this.add('text', {x: width - 8, y: this.top + 6, 'text-anchor': 'end'},
               `peak ${this.options.format(this.peak)}`);
    }
    this.pointer = this.add('line', {class: 'pointer', y1: this.top, y2: height - 22, visibility: 'hidden'});
    this.cursor = this.add('line', {class: 'cursor', y1: this.top, y2: height - 22});
    this.dots = this.options.stacked ? [] : this.options.series.map(
        (series) => this.add('circle', {class: 'dot', r: 4, fill: series.color}));
    this.moveTo(this.current);
  }

  drawFrameAxis(height) {
    const bottom = height - 22;
    this.add('line', {class: 'axis', x1: this.left, x2: this.left + this.innerWidth, y1: bottom, y2: bottom});
    const last = this.labels.length - 1;
    const wanted = Math.max(2, Math.min(8, Math.floor(this.innerWidth / 60)));
    const positions = last === 0 ? [0] : ticksOf(0, last, wanted).filter(Number.isInteger);
    for (const position of positions) {
      this.add('text', {x: this.x(position), y: height - 7, 'text-anchor': 'middle'},
               shown(this.labels[position]));
    }
  }

  drawSeries() {
    // A single frame is drawn as a level across the whole width.
    const single = this.labels.length === 1;
    const place = (values) => single
        ? [[this.left, this.y(values[0])], [this.left + this.innerWidth, this.y(values[0])]]
        : values.map((value, k) => [this.x(k), this.y(value)]);
    const join = (points) => points.map(([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`).join('L');
    this.options.series.forEach((series, s) => {
      const above = place(this.tops[s]);
      if (!this.options.stacked) {
        this.add('path', {class: 'curve', stroke: series.color, d: 'M' + join(above)});
        return;
      }
      const below = place(s === 0 ? series.values.map(() => 0) : this.tops[s - 1]).reverse();
      this.add('path', {class: 'band', fill: series.color, d: `M${join(above)}L${join(below)}Z`});
    });
  }

  // Moves the cursor and shows the numbers of that frame.
  moveTo(position) {
    this.current = position;
    this.tell(position);
    if (!this.cursor) return;
    const x = this.x(position);
    this.cursor.setAttribute('x1', x);
    this.cursor.setAttribute('x2', x);
    this.dots.forEach((dot, s) => {
      dot.setAttribute('cx', x);
      dot.setAttribute('cy', this.y(this.options.series[s].values[position]));
    });
  }

  tell(position) {
    if (this.labels.length === 0) return;
    this.options.series.forEach((series, s) => {
      this.values[s].textContent = this.options.format(series.values[position]);
    });
    this.caption.textContent = this.options.caption(position);
  }

  positionAt(event) {
    const share = (event.clientX - this.svg.getBoundingClientRect().left - this.left) / this.innerWidth;
    const last = this.labels.length - 1;
    return Math.max(0, Math.min(last, Math.round(share * last)));
  }

  listen() {
    this.svg.addEventListener('pointerdown', (event) => {
      if (this.labels.length === 0) return;
      this.svg.setPointerCapture(event.pointerId);
      this.options.pick(this.positionAt(event));
    });
    this.svg.addEventListener('pointermove', (event) => {
      if (!this.pointer) return;
      const position = this.positionAt(event);
      if (this.svg.hasPointerCapture(event.pointerId)) this.options.pick(position);
      this.pointer.setAttribute('x1', this.x(position));
      this.pointer.setAttribute('x2', this.x(position));
      this.pointer.setAttribute('visibility', 'visible');
      this.tell(position);
    });
    this.svg.addEventListener('pointerleave', () => {
      if (!this.pointer) return;
      this.pointer.setAttribute('visibility', 'hidden');
      this.tell(this.current);
    });
  }
}
