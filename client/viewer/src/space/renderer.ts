// Draws surfaces by three.js, or without WebGL 2 by `CanvasDrawing`. Bundled as space.js, which the page loads when it shows a surface.
import {
  AlwaysDepth, BackSide, BufferAttribute, BufferGeometry, Color, ColorManagement, DataTexture, DoubleSide, EqualStencilFunc,
  FrontSide, LinearSRGBColorSpace, LineSegments, Mesh, OrthographicCamera, PerspectiveCamera, PlaneGeometry, Points,
  Plane, ReplaceStencilOp, Scene, ShaderMaterial, Vector2, Vector3, Vector4, WebGLRenderer, type Camera as ThreeCamera,
  type IUniform, type Side,
} from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';
import type { Rgb } from '../draw/colours';
import { dotDiameter, EDGE_ALPHA } from '../draw/style';
import type { Size } from '../draw/view';
import type { Surface } from '../protocol/surface';
import { CanvasDrawing } from './canvas_drawing';
import { axesOf, distanceOf, FIELD_OF_VIEW, minus, plus, unitsPerPixel } from './camera';
import {
  BORDER_WIDTH, HIDDEN_LINES, type SectionLines, SMALLEST_DOT, type SpaceDrawing, type SpaceState, TRANSLUCENT, TRANSLUCENT_EDGES,
} from './drawing';
import {
  COLOUR_MODE, CUT_FACE_FRAGMENT, CUT_FACE_VERTEX, EDGE_FRAGMENT, EDGE_VERTEX, POINT_FRAGMENT, POINT_VERTEX,
  SURFACE_FRAGMENT, SURFACE_VERTEX,
} from './shaders';

const MAP_COLOURS = 256;
/** Cuts nothing: no point is above an infinite height. */
const NO_CLIP = 1e30;
/** Largest depth over which the border of a cut is smoothed, in pixels. At silhouettes the depth changes without limit. */
const DEEPEST_BORDER = 8;

// The shaders use sRGB throughout.
ColorManagement.enabled = false;

type Uniforms = Record<string, IUniform>;

/** Uniforms that several materials share. */
function commonUniforms(): Uniforms {
  return {
    clip: { value: new Vector4(0, 0, 0, NO_CLIP) }, ramp: { value: null }, range: { value: new Vector2() },
    missing: { value: new Color() }, mode: { value: COLOUR_MODE.tint },
  };
}

/** Replaces numbers of an attribute, in the same buffer if their count stays: three.js frees buffers by geometry. */
function setNumbers(geometry: BufferGeometry, name: string, numbers: Float32Array | Uint8Array, size: number): void {
  const held = geometry.getAttribute(name) as BufferAttribute | undefined;
  if (held?.array === numbers) return;
  if (held?.array.length !== numbers.length) {
    geometry.setAttribute(name, new BufferAttribute(numbers, size, numbers instanceof Uint8Array));
    return;
  }
  held.array = numbers;
  held.needsUpdate = true;
}

/** A section in the picture: its lines in front of the surface, and behind it, where they are faint. */
class SectionPart {
  private readonly parts: readonly LineSegments2[];
  private isBorder = false;

  /** The materials stay from frame to frame, so that their program is compiled once. */
  constructor(private readonly scene: Scene) {
    this.parts = [false, true].map((isVisible) => {
      const material = new LineMaterial({ depthTest: isVisible, transparent: true, opacity: isVisible ? 1 : HIDDEN_LINES });
      const part = new LineSegments2(new LineSegmentsGeometry(), material);
      part.frustumCulled = false;
      scene.add(part);
      return part;
    });
  }

  show({ positions, colour, isBorder }: SectionLines): void {
    this.isBorder = isBorder;
    const geometry = new LineSegmentsGeometry();
    if (positions.length > 0) geometry.setPositions(positions);
    for (const part of this.parts) {
      part.geometry.dispose();
      part.geometry = geometry;
      part.visible = positions.length > 0;
      part.material.color.setRGB(...colour);
    }
  }

  /** `planes`: clip planes of the lines. */
  setStyle(lineWidth: number, { width, height }: Size, planes: Plane[]): void {
    for (const { material } of this.parts) {
      material.clippingPlanes = planes;
      material.linewidth = this.isBorder ? BORDER_WIDTH : lineWidth;
      material.resolution.set(width, height);
    }
  }

  destroy(): void {
    for (const part of this.parts) {
      this.scene.remove(part);
      part.geometry.dispose();
      part.material.dispose();
    }
  }
}

function setColour(uniform: IUniform, [red, green, blue]: Rgb): void {
  (uniform.value as Color).setRGB(red, green, blue);
}

class Drawing implements SpaceDrawing {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly perspective = new PerspectiveCamera(FIELD_OF_VIEW);
  private readonly parallel = new OrthographicCamera();
  private readonly common = commonUniforms();
  private readonly surfaceUniforms: Uniforms = {
    ...this.common, isFlat: { value: false }, isParallel: { value: false }, hasCutFace: { value: false }, deepest: { value: 0 },
    opacity: { value: 1 }, accent: { value: new Color() }, ambient: { value: 0.3 },
  };
  private readonly pointUniforms: Uniforms = {
    ...this.common, mode: { value: COLOUR_MODE.tint }, colour: { value: new Color() }, diameter: { value: 1 },
    smallest: { value: 1 }, distance: { value: 0 },
  };
  private readonly edgeUniforms: Uniforms = { clip: this.common.clip, colour: { value: new Color() }, opacity: { value: 1 } };
  private readonly background = new Color();
  private ramp: DataTexture | null = null;
  private rampOf: Uint8Array | null = null;
  private surface: Surface | null = null;
  private geometry = new BufferGeometry();
  private edgeGeometry = new BufferGeometry();
  private pointGeometry = new BufferGeometry();
  /** A surface that is translucent or has a cut face is drawn in two steps, inside first. Others: `outside` alone. */
  private readonly inside: Mesh<BufferGeometry, ShaderMaterial>;
  private readonly outside: Mesh<BufferGeometry, ShaderMaterial>;
  /**
   * Writes the depth of the clip plane where the plane cuts a body, so that the cut face hides the body's content. The
   * surface draws the face's colour. `inside` sets the stencil and `outside` clears it. The stencil therefore stays set
   * at pixels where an inside is in front.
   */
  private readonly cutFace = new Mesh(new PlaneGeometry(2, 2), new ShaderMaterial({
    vertexShader: CUT_FACE_VERTEX, fragmentShader: CUT_FACE_FRAGMENT, side: DoubleSide, colorWrite: false,
    depthFunc: AlwaysDepth, stencilWrite: true, stencilFunc: EqualStencilFunc, stencilRef: 1,
    // Lines in the plane are wide, and must be in front of it.
    polygonOffset: true, polygonOffsetFactor: 3, polygonOffsetUnits: 3,
  }));
  private readonly edges: LineSegments;
  private readonly points: Points;
  private readonly sections: SectionPart[] = [];

  constructor(canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: false, stencil: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    // Parts are drawn in the order of `add`. Sorting would compute bounding spheres: 4 ms a frame of 200,000 triangles.
    this.renderer.sortObjects = false;
    this.renderer.localClippingEnabled = true;
    const material = (side: Side, stencilRef: number) => new ShaderMaterial({
      vertexShader: SURFACE_VERTEX, fragmentShader: SURFACE_FRAGMENT, uniforms: this.surfaceUniforms, side,
      polygonOffsetFactor: 1, polygonOffsetUnits: 1, stencilRef, stencilZPass: ReplaceStencilOp,
    });
    this.inside = new Mesh(this.geometry, material(BackSide, 1));
    this.outside = new Mesh(this.geometry, material(DoubleSide, 0));
    this.edges = new LineSegments(this.edgeGeometry, new ShaderMaterial({
      vertexShader: EDGE_VERTEX, fragmentShader: EDGE_FRAGMENT, uniforms: this.edgeUniforms, transparent: true, depthWrite: false,
    }));
    this.points = new Points(this.pointGeometry, new ShaderMaterial({
      vertexShader: POINT_VERTEX, fragmentShader: POINT_FRAGMENT, uniforms: this.pointUniforms,
    }));
    for (const one of [this.inside, this.outside, this.cutFace, this.points, this.edges]) {
      one.frustumCulled = false;
      one.matrixAutoUpdate = false;
      this.scene.add(one);
    }
  }

  show(surface: Surface | null): void {
    this.surface = surface;
    for (const geometry of [this.geometry, this.edgeGeometry, this.pointGeometry]) geometry.dispose();
    this.geometry = this.inside.geometry = this.outside.geometry = new BufferGeometry();
    this.edgeGeometry = this.edges.geometry = new BufferGeometry();
    this.pointGeometry = this.points.geometry = new BufferGeometry();
    if (!surface) return;
    const { positions, normals, triangles, inCut, particles } = surface;
    const places = new BufferAttribute(positions, 3);
    this.geometry.setAttribute('position', places);
    this.geometry.setAttribute('normal', normals instanceof Int8Array
      ? new BufferAttribute(normals, 4, true) : new BufferAttribute(normals, 3));
    // Without this attribute, the shader reads 0 at each point.
    if (inCut) this.geometry.setAttribute('inCut', new BufferAttribute(inCut, 1, true));
    this.geometry.setIndex(new BufferAttribute(triangles, 1));
    this.edgeGeometry.setAttribute('position', places);
    if (particles) this.pointGeometry.setAttribute('position', new BufferAttribute(particles, 3));
  }

  setTints(tints: Uint8Array): void {
    setNumbers(this.geometry, 'tint', tints, 4);
  }

  setSections(lines: readonly SectionLines[]): void {
    while (this.sections.length > lines.length) this.sections.pop()?.destroy();
    while (this.sections.length < lines.length) this.sections.push(new SectionPart(this.scene));
    lines.forEach((section, k) => this.sections[k].show(section));
  }

  draw(state: SpaceState): void {
    const { camera: { size, isPerspective }, theme, lineWidth } = state;
    this.resize(state);
    this.renderer.setClearColor(this.background.setRGB(...theme.background), 1);
    this.setUniforms(state);
    this.setParts(state);
    this.placeCutFace(state);
    const planes = this.clipOfLines(state);
    for (const section of this.sections) section.setStyle(lineWidth, size, planes);
    this.renderer.render(this.scene, this.placed(isPerspective ? this.perspective : this.parallel, state));
  }

  destroy(): void {
    this.show(null);
    this.setSections([]);
    this.cutFace.geometry.dispose();
    this.ramp?.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** Calls the setters only for a new size: each call reallocates the picture. */
  private resize({ camera: { size: { width, height } }, ratio }: SpaceState): void {
    const held = this.renderer.getSize(new Vector2());
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    if (held.x !== width || held.y !== height) this.renderer.setSize(width, height, false);
  }

  private setUniforms(state: SpaceState): void {
    const { look, theme, clip, values, camera, spacing, ratio } = state;
    const { common, surfaceUniforms, pointUniforms, edgeUniforms } = this;
    if (clip) (common.clip.value as Vector4).set(...clip.normal, clip.at);
    else (common.clip.value as Vector4).set(0, 0, 0, NO_CLIP);
    setColour(common.missing, theme.missing);
    this.setValues(state);
    common.mode.value = values?.points ? COLOUR_MODE.values : COLOUR_MODE.tint;
    pointUniforms.mode.value = values?.particles ? COLOUR_MODE.values : COLOUR_MODE.tint;
    surfaceUniforms.isFlat.value = look.shading === 'flat';
    surfaceUniforms.isParallel.value = !look.isPerspective;
    surfaceUniforms.opacity.value = look.isTranslucent ? TRANSLUCENT : 1;
    surfaceUniforms.deepest.value = DEEPEST_BORDER * unitsPerPixel(camera) / ratio;
    surfaceUniforms.ambient.value = theme.ambient;
    setColour(surfaceUniforms.accent, theme.accent);
    setColour(pointUniforms.colour, theme.particle);
    pointUniforms.diameter.value = ratio * dotDiameter(spacing / unitsPerPixel(camera));
    pointUniforms.smallest.value = ratio * SMALLEST_DOT;
    pointUniforms.distance.value = camera.isPerspective ? distanceOf(camera.view) : 0;
    setColour(edgeUniforms.colour, theme.edge);
    edgeUniforms.opacity.value = look.isTranslucent ? TRANSLUCENT_EDGES : EDGE_ALPHA;
  }

  private setValues({ values }: SpaceState): void {
    if (!values) return;
    if (values.points) setNumbers(this.geometry, 'value', values.points, 1);
    if (values.particles) setNumbers(this.pointGeometry, 'value', values.particles, 1);
    (this.common.range.value as Vector2).set(values.min, values.max);
    if (values.texels === this.rampOf) return;
    this.ramp?.dispose();
    this.rampOf = values.texels;
    this.ramp = new DataTexture(values.texels, MAP_COLOURS, 1);
    this.ramp.needsUpdate = true;
    this.common.ramp.value = this.ramp;
  }

  private setParts({ look, hasSurface, hasEdges, hasParticles, clip, cutFace }: SpaceState): void {
    const { surface } = this;
    const hasTriangles = (surface?.triangles.length ?? 0) > 0;
    const hasTwoSteps = look.isTranslucent || cutFace !== null;
    this.inside.visible = hasSurface && hasTriangles && hasTwoSteps;
    this.outside.visible = hasSurface && hasTriangles;
    this.cutFace.visible = this.outside.visible && cutFace !== null;
    this.edges.visible = hasEdges && hasTriangles;
    this.points.visible = hasParticles && (surface?.particles?.length ?? 0) > 0;
    if (this.edges.visible && surface && !this.edgeGeometry.index) {
      this.edgeGeometry.setIndex(new BufferAttribute(surface.edges, 1));
    }
    for (const material of [this.inside.material, this.outside.material]) {
      material.transparent = look.isTranslucent;
      material.depthWrite = !look.isTranslucent;
      material.alphaToCoverage = clip !== null && !look.isTranslucent;
      material.stencilWrite = cutFace !== null;
      // Edges and sections lie in the surface, and must be in front of it. The offset shows silhouettes in cut faces.
      material.polygonOffset = hasEdges || this.sections.length > 0;
    }
    this.outside.material.side = hasTwoSteps ? FrontSide : DoubleSide;
  }

  /** The clip plane for lines, moved by their width, so that lines in the plane stay visible. */
  private clipOfLines({ clip, camera, lineWidth }: SpaceState): Plane[] {
    if (!clip) return [];
    return [new Plane(new Vector3(...clip.normal).negate(), clip.at + lineWidth * unitsPerPixel(camera))];
  }

  private placeCutFace({ clip, cutFace }: SpaceState): void {
    this.surfaceUniforms.hasCutFace.value = cutFace !== null;
    if (!clip || !cutFace) return;
    const { cutFace: { position, quaternion, scale } } = this;
    position.set(...cutFace.middle);
    quaternion.setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...clip.normal));
    scale.setScalar(cutFace.halfWidth);
    this.cutFace.updateMatrix();
  }

  private placed(camera: PerspectiveCamera | OrthographicCamera, { camera: { view, size }, near, far, origin }: SpaceState): ThreeCamera {
    const { up, back } = axesOf(view);
    const target = minus(view.target, origin);
    camera.position.set(...plus(target, back, distanceOf(view)));
    camera.up.set(...up);
    camera.lookAt(new Vector3(...target));
    camera.near = near;
    camera.far = far;
    const aspect = Math.max(1, size.width) / Math.max(1, size.height);
    if (camera instanceof PerspectiveCamera) {
      camera.aspect = aspect;
    } else {
      camera.top = view.height / 2;
      camera.bottom = -camera.top;
      camera.right = camera.top * aspect;
      camera.left = -camera.right;
    }
    camera.updateProjectionMatrix();
    return camera;
  }
}

/** Draws by WebGL 2, or without it by the processor. Throws an Error with a sentence if the browser cannot draw. */
export function createDrawing(canvas: HTMLCanvasElement): SpaceDrawing {
  const hasWebgl = canvas.getContext('webgl2', { antialias: true, alpha: false, stencil: true }) !== null;
  return hasWebgl ? new Drawing(canvas) : new CanvasDrawing(canvas);
}
