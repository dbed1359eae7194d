
// Above this many triangles the mesh waits until the pictures stand still.
const BIG_MESH = 50000;
const BIG_MESH_DELAY_MS = 150;

const byId = (id) => document.getElementById(id);

class Page {
  constructor() {
    this.frames = [...document.querySelectorAll('script.frame-numbers')].map((one) => JSON.parse(one.textContent));
    this.geometries = document.querySelectorAll('script.frame-geometry');
    this.labels = this.frames.map((frame) => frame.frame);
    this.projection = new Projection(sceneOf(this.frames));
    this.picture = byId('picture');
    this.layers = ['outline', 'mesh', 'particles', 'normals', 'isolines', 'colors'];
    this.offerColors();
    this.position = 0;
    this.playing = false;
    this.charts = this.makeCharts();
    byId('slider').max = Math.max(0, this.frames.length - 1);
    document.body.dataset.frames = this.frames.length;
    this.resetView();
    this.listen();
    if (this.frames.length === 0) {
      byId('position').textContent = 'no frames';
      return;
    }
    this.readHash();
  }

  // All frames share one range of colours, so that a colour means the same in each.
  offerColors() {
    const ranges = this.frames.map((frame) => frame.colors).filter(Boolean);
    if (ranges.length === 0) return;
    this.colorRange = [Math.min(...ranges.map((range) => range[0])), Math.max(...ranges.map((range) => range[1]))];
    byId('show-colors').parentElement.hidden = false;
    const range = byId('range');
    range.hidden = false;
    range.firstElementChild.textContent = shown(this.colorRange[0]);
    range.lastElementChild.textContent = shown(this.colorRange[1]);
    range.children[1].style.background =
        `linear-gradient(90deg, ${COLOR_STOPS.map((stop) => '#' + stop).join(', ')})`;
  }

  drawColors(on) {
    const geometry = this.geometry;
    const has = on && geometry.colors.length > 0;
    const inside = has && geometry.triangles.length > 0 && geometry.colors.length * 2 === geometry.meshPoints.length;
    const [low, high] = this.frames[this.position].colors ?? [0, 0];
    const [least, most] = this.colorRange ?? [0, 0];
    const shareOf = (byte) => most > least ? (low + byte / 255 * (high - low) - least) / (most - least) : 0.5;
    const paint = (id, bands, attributes) => byId(id).replaceChildren(...bands.flatMap((path, band) => {
      if (!path) return [];
      const element = document.createElementNS(this.picture.namespaceURI, 'path');
      element.setAttribute('d', path);
      for (const name of attributes) element.style[name] = colorOf((band + 0.5) / COLOR_BANDS);
      return [element];
    }));
    this.picture.classList.toggle('colored', inside);
    paint('colors', inside ? this.projection.coloredTriangles(geometry, shareOf) : [], ['fill', 'stroke']);
    paint('color-lines', has && !inside ? this.projection.coloredRings(geometry, shareOf) : [], ['stroke']);
  }

  makeCharts() {
    const column = (name) => this.frames.map((frame) => frame[name]);
    const pick = (position) => { this.pause(); this.show(position); };
    const stages = byId('chart-milliseconds').dataset.stages.split(' ');
    const reduction = (frame) => frame.triangles_grid > 0
        ? `${(100 * (1 - frame.triangles / frame.triangles_grid)).toFixed(1)} % fewer` : '';
    const at = (position) => `frame ${this.labels[position]}`;
    return [
      new Chart(byId('chart-area'), this.labels, {
        series: [{name: 'area', color: 'var(--merged-series)', values: column('area')}],
        format: (value) => shown(value, 6), pick, caption: at}),
      new Chart(byId('chart-triangles'), this.labels, {
        series: [{name: 'unmerged', color: 'var(--grid-series)', values: column('triangles_grid')},
                 {name: 'merged', color: 'var(--merged-series)', values: column('triangles')}],
        fromZero: true, format: (value) => shown(value), pick,
        caption: (position) => [reduction(this.frames[position]), at(position)].filter(Boolean).join(' \u00b7 ')}),
      new Chart(byId('chart-milliseconds'), this.labels, {
        series: stages.map((name, s) => ({
          name, color: `var(--stage-${s})`, values: this.frames.map((frame) => frame.stages[s] ?? 0)})),
        stacked: true, fromZero: true, format: shownMs, pick,
        caption: (position) => `${shownMs(this.frames[position].milliseconds)} ms \u00b7 ${at(position)}`}),
    ];
  }

  // ---- The current frame ----

  show(position) {
    if (this.frames.length === 0) return;
    this.position = Math.max(0, Math.min(this.frames.length - 1, position));
    const frame = this.frames[this.position];
    this.geometry = decodeGeometry(this.geometries[this.position].textContent);
    byId('slider').value = this.position;
    byId('slider').setAttribute('aria-valuetext', `frame ${frame.frame}`);
    byId('position').innerHTML = `frame <b>${frame.frame}</b> \u00b7 ${this.position + 1} of ${this.frames.length}` +
        (frame.time === null ? '' : ` \u00b7 t = ${shown(frame.time, 5)}`);
    document.body.dataset.frame = frame.frame;
    this.draw();
    this.showNumbers(frame);
    this.charts.forEach((chart) => chart.moveTo(this.position));
    this.hover(-1);
    this.writeHash();
  }

  draw() {
    const geometry = this.geometry;
    if (!geometry) return;
    const shows = (layer) => byId(`show-${layer}`).checked;
    const set = (id, on, path) => byId(id).setAttribute('d', on ? path() : '');
    const spacing = (this.frames[this.position].spacing || 0) * this.projection.scale;
    set('inside', true, () => this.projection.rings(geometry));
    set('outline', shows('outline'), () => this.projection.rings(geometry));
    const isolines = geometry.isolines.outerOf.length > 0;
    if (isolines) byId('show-isolines').parentElement.hidden = false;
    set('isolines', isolines && shows('isolines'), () => this.projection.rings(geometry.isolines));
    this.drawColors(shows('colors'));
    set('particles', shows('particles'), () => this.projection.particles(geometry));
    byId('particles').setAttribute('stroke-width', Math.max(0.45 * spacing, 1.2));
    set('normals', shows('normals'), () => this.projection.normals(geometry, Math.max(1.5 * spacing, 6)));
    clearTimeout(this.meshTimer);
    const big = geometry.interior.length > BIG_MESH;
    this.drawMesh(shows('mesh') && !big);
    if (shows('mesh') && big && !this.playing) {
      this.meshTimer = setTimeout(() => this.drawMesh(true), BIG_MESH_DELAY_MS);
    }
    this.showNotes(big);
  }

  drawMesh(on) {
    for (const [id, interior] of [['mesh-boundary', 0], ['mesh-interior', 1]]) {
      byId(id).setAttribute('d', on ? this.projection.triangles(this.geometry, interior) : '');
    }
  }

  showNotes(big) {
    const frame = this.frames[this.position];
    const notes = [];
    if (big && this.playing) notes.push('mesh drawn when paused');
    if (!frame.mesh_shown) notes.push('mesh too large for this page');
    if (frame.particles_shown < frame.particles_given) {
      notes.push(`${shown(frame.particles_shown)} of ${shown(frame.particles_given)} particles drawn`);
    }
    byId('notes').textContent = notes.join(' \u00b7 ');
  }

  showNumbers(frame) {
    const reduction = frame.triangles_grid > 0
        ? `${(100 * (1 - frame.triangles / frame.triangles_grid)).toFixed(1)} %` : '-';
    const numbers = [
      ['Particles', shown(frame.particles)], ['Polylines', shown(frame.polylines)],
      ['Vertices', shown(frame.vertices)], ['Area', shown(frame.area, 6)],
      ['Perimeter', shown(frame.perimeter, 6)], ['Unmerged', shown(frame.triangles_grid)],
      ['Merged', shown(frame.triangles)], ['Reduction', reduction],
      ['Milliseconds', shownMs(frame.milliseconds)], ['Spacing', shown(frame.spacing, 5)],
    ];
    if (frame.dropped_holes > 0) numbers.push(['Dropped holes', shown(frame.dropped_holes)]);
    if (frame.dropped_components > 0) numbers.push(['Dropped pieces', shown(frame.dropped_components)]);
    if (frame.dropped_spray > 0) numbers.push(['Dropped spray', shown(frame.dropped_spray)]);
    if (frame.self_intersections > 0) numbers.push(['Self-crossings', shown(frame.self_intersections), 'alert']);
    if (frame.folded_triangles > 0) numbers.push(['Folded', shown(frame.folded_triangles), 'alert']);
    if (frame.doubts) numbers.push(['Doubts', frame.doubts.replaceAll(' ', ', '), 'alert']);
    numbers.push(['Digests', `rings ${frame.rings_digest}, mesh ${frame.mesh_digest}`, 'digest']);
    byId('numbers').replaceChildren(...numbers.map(([name, value, kind]) => {
      const cell = document.createElement('div');
      if (kind) cell.className = kind;
      cell.appendChild(document.createElement('dt')).textContent = name;
      cell.appendChild(document.createElement('dd')).textContent = value;
      return cell;
    }));
  }

  // ---- Playing ----

  play() {
    if (this.playing || this.frames.length < 2) return;
    this.playing = true;
    document.body.classList.add('playing');
    let shownAt = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      const frames = Math.floor((now - shownAt) / 1000 * Number(byId('speed').value));
      if (frames > 0) {
        shownAt += frames * 1000 / Number(byId('speed').value);
        this.show((this.position + frames) % this.frames.length);
      }
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    document.body.classList.remove('playing');
    this.draw();
    this.writeHash();
  }

  step(by) {
    this.pause();
    this.show(this.position + by);
  }

  // ---- Zoom ----

  resetView() {
    const {width, height} = this.projection;
    this.view = {x: 0, y: 0, width, height};
    this.applyView();
  }

  // Keeps the picture's point under (clientX, clientY) where it is.
  zoom(factor, clientX, clientY) {
    const wanted = this.view.width * factor;
    if (wanted > 20 * this.projection.width || wanted < 1e-3 * this.projection.width) return;
    const at = clientX === undefined
        ? {x: this.view.x + this.view.width / 2, y: this.view.y + this.view.height / 2}
        : this.toPicture(clientX, clientY);
    this.view.x = at.x + (this.view.x - at.x) * factor;
    this.view.y = at.y + (this.view.y - at.y) * factor;
    this.view.width *= factor;
    this.view.height *= factor;
    this.applyView();
  }

  applyView() {
    const {x, y, width, height} = this.view;
    this.picture.setAttribute('viewBox', `${x} ${y} ${width} ${height}`);
    this.showScale();
    this.hover(-1);
  }

  // Screen pixels per unit of the picture.
  pixels() {
    const box = this.picture.getBoundingClientRect();
    return Math.min(box.width / this.view.width, box.height / this.view.height);
  }

  toPicture(clientX, clientY) {
    const box = this.picture.getBoundingClientRect();
    const pixels = this.pixels();
    return {
      x: this.view.x + this.view.width / 2 + (clientX - box.left - box.width / 2) / pixels,
      y: this.view.y + this.view.height / 2 + (clientY - box.top - box.height / 2) / pixels,
    };
  }

  showScale() {
    const perWorld = this.pixels() * this.projection.scale;
    if (!(perWorld > 0) || !Number.isFinite(perWorld)) return;
    const longest = 120 / perWorld;
    const power = 10 ** Math.floor(Math.log10(longest));
    const length = [5, 2, 1].map((digit) => digit * power).find((size) => size <= longest);
    const scale = byId('scale');
    scale.firstElementChild.textContent = shown(length, 2);
    scale.lastElementChild.style.width = `${length * perWorld}px`;
  }

  // ---- Pointing at a ring ----

  point(event) {
    const geometry = this.geometry;
    if (!geometry) return;
    const at = this.toPicture(event.clientX, event.clientY);
    const x = this.projection.left + at.x / this.projection.scale;
    const y = this.projection.top - at.y / this.projection.scale;
    const ring = ringAt(geometry, (x - geometry.originX) / geometry.step, (y - geometry.originY) / geometry.step);
    this.hover(ring);
    const tip = byId('tip');
    const box = this.picture.getBoundingClientRect();
    const lines = [`x ${shown(x, 5)}   y ${shown(y, 5)}`];
    if (ring >= 0) {
      const [area, perimeter, particles, identity, parents] = this.frames[this.position].measures[ring];
      const hole = geometry.outerOf[ring] >= 0;
      lines.push(hole ? `hole ${ring} of ring ${geometry.outerOf[ring]}` : `ring ${ring}`);
      lines.push(`area ${shown(area, 6)}`, `perimeter ${shown(perimeter, 6)}`);
      if (!hole) lines.push(`particles ${shown(particles)}`);
      if (identity !== '0') lines.push(`identity ${identity}`);
      if (parents.some((parent) => parent !== identity)) lines.push(`from ${parents.join(', ')}`);
    }
    tip.textContent = lines.join('\n');
    tip.hidden = false;
    const right = event.clientX - box.left > box.width / 2;
    const low = event.clientY - box.top > box.height / 2;
    tip.style.left = `${event.clientX - box.left + (right ? -14 - tip.offsetWidth : 14)}px`;
    tip.style.top = `${event.clientY - box.top + (low ? -10 - tip.offsetHeight : 14)}px`;
  }

  hover(ring) {
    byId('hovered').setAttribute('d', ring < 0 ? '' : this.projection.rings(this.geometry, ring, ring + 1));
    if (ring < 0) byId('tip').hidden = true;
  }

  // ---- Input ----

  listen() {
    byId('slider').addEventListener('input', (event) => { this.pause(); this.show(Number(event.target.value)); });
    const on = (id, action) => byId(id).addEventListener('click', action);
    on('first', () => this.step(-Infinity));
    on('previous', () => this.step(-1));
    on('play', () => this.toggle());
    on('next', () => this.step(1));
    on('last', () => this.step(Infinity));
    on('zoom-in', () => this.zoom(1 / 1.5));
    on('zoom-out', () => this.zoom(1.5));
    on('zoom-reset', () => this.resetView());
    for (const layer of this.layers) {
      byId(`show-${layer}`).addEventListener('change', () => { this.draw(); this.writeHash(); });
    }
    document.addEventListener('keydown', (event) => this.key(event));
    window.addEventListener('hashchange', () => this.readHash());
    new ResizeObserver(() => this.showScale()).observe(this.picture);
    this.listenToPicture();
  }

  listenToPicture() {
    this.picture.addEventListener('wheel', (event) => {
      if (!event.ctrlKey && !event.metaKey) return;  // The page scrolls as usual.
      event.preventDefault();
      this.zoom(Math.exp(Math.max(-60, Math.min(60, event.deltaY)) * 0.005), event.clientX, event.clientY);
    }, {passive: false});
    this.picture.addEventListener('dblclick', () => this.resetView());
    this.picture.addEventListener('pointerdown', (event) => {
      this.picture.setPointerCapture(event.pointerId);
      this.picture.classList.add('dragging');
      this.drag = {x: event.clientX, y: event.clientY};
    });
    this.picture.addEventListener('pointermove', (event) => {
      if (!this.drag) {
        this.point(event);
        return;
      }
      const pixels = this.pixels();
      this.view.x -= (event.clientX - this.drag.x) / pixels;
      this.view.y -= (event.clientY - this.drag.y) / pixels;
      this.drag = {x: event.clientX, y: event.clientY};
      this.applyView();
    });
    for (const end of ['pointerup', 'pointercancel']) {
      this.picture.addEventListener(end, () => {
        this.drag = null;
        this.picture.classList.remove('dragging');
      });
    }
    this.picture.addEventListener('pointerleave', () => this.hover(-1));
  }

  toggle() {
    if (this.playing) this.pause(); else this.play();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === 'SELECT') return;
    const press = (id) => byId(id).click();
    const actions = {
      'ArrowLeft': () => this.step(-1), 'ArrowRight': () => this.step(1),
      'Home': () => this.step(-Infinity), 'End': () => this.step(Infinity),
      ' ': () => this.toggle(),
      'o': () => press('show-outline'), 'm': () => press('show-mesh'),
      'p': () => press('show-particles'), 'n': () => press('show-normals'),
      'i': () => press('show-isolines'), 'c': () => press('show-colors'),
      '+': () => this.zoom(1 / 1.5), '=': () => this.zoom(1 / 1.5), '-': () => this.zoom(1.5),
      '0': () => this.resetView(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  // ---- The address: #frame=10&play=0&layers=outline,mesh ----

  readHash() {
    const wanted = new URLSearchParams(location.hash.slice(1));
    if (wanted.has('layers')) {
      const on = wanted.get('layers').split(',');
      for (const layer of this.layers) byId(`show-${layer}`).checked = on.includes(layer);
    }
    const index = Number(wanted.get('frame') ?? NaN);
    const position = this.labels.findIndex((label) => label >= index);
    this.pause();
    this.show(!Number.isFinite(index) ? this.position : position < 0 ? this.frames.length - 1 : position);
    if (wanted.get('play') === '1') this.play();
  }

  writeHash() {
    if (this.playing) return;
    const on = this.layers.filter((layer) => byId(`show-${layer}`).checked);
    const hash = `#frame=${this.labels[this.position]}&layers=${on.join(',')}`;
    // Some browsers refuse it for pages opened from disk; the page works without.
    try { history.replaceState(null, '', hash); } catch (error) { return; }
  }
}

new Page();
