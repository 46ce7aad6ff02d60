//! The elements of a scene: both sides of its triangles, divided again and again.

use super::basis::{Part, QUARTERS, SIX, WHOLE, functions, quarter_of};
use super::form_factor::Panel;
use glam::DVec2;
use rayon::prelude::*;
use sampling::bsdf::{Lobes, TransportMode};
use sampling::math::Spectrum;
use sampling::{Vec3, vec2};
use scenes::{Facet, Interaction, Scene};
use std::f64::consts::PI;

/// Coefficients of a function on an element, by basis function and channel; of a constant, those of the others are zero.
pub type Coefficients = [[f64; 3]; 3];

/// A side of a triangle, or of a part of one.
#[derive(Clone, Debug)]
pub struct Element {
    /// Where it is; its normal is on the side that is meant.
    pub panel: Panel,
    /// The triangle.
    pub facet: usize,
    /// Where it lies in the triangle's barycentric coordinates.
    pub part: Part,
    /// Mean albedo.
    pub albedo: [f64; 3],
    /// Emitted radiosity \[W/m²\].
    pub emitted: Coefficients,
}

/// A node of the trees in which elements lie.
#[derive(Clone, Copy, Debug)]
struct Node {
    facet: u32,
    back: bool,
    part: Part,
    parent: Option<u32>,
    content: Content,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Content {
    /// The number of an element.
    Element(u32),
    /// The first of four nodes, of the quarters.
    Quarters(u32),
}

/// A scene's elements, and the trees in which they are found.
#[derive(Clone, Debug)]
pub struct Mesh {
    facets: Vec<Facet>,
    nodes: Vec<Node>,
    /// Of each side of each triangle, front first; `None` where nothing lies ahead of it.
    roots: Vec<Option<u32>>,
    elements: Vec<Element>,
    /// The node of each element.
    places: Vec<u32>,
    /// Whether no surface can hide one from another.
    convex: bool,
}

/// What a surface that obeys Lambert's law reflects of the light that arrives.
pub fn albedo(it: &Interaction) -> Spectrum {
    it.bsdf.eval(Vec3::Z, Vec3::Z, Lobes::ALL, TransportMode::Radiance) * std::f32::consts::PI
}

impl Mesh {
    /// An element for every side of every triangle that has anything ahead of it.
    pub fn new(scene: &Scene, facets: Vec<Facet>) -> Self {
        let extent = f64::from(scene.bounds.radius);
        let (low, high): (Vec<f64>, Vec<f64>) = facets.par_iter().map(|facet| heights(facet, &facets)).unzip();
        let ahead = |facet: usize| [high[facet] > 1e-6 * extent, low[facet] < -1e-6 * extent];
        let convex = (0..facets.len()).all(|facet| ahead(facet) != [true, true]);
        let (mut nodes, mut roots) = (Vec::new(), Vec::new());
        for facet in 0..facets.len() {
            for (back, ahead) in [false, true].into_iter().zip(ahead(facet)) {
                roots.push(ahead.then_some(nodes.len() as u32));
                let content = Content::Element(nodes.len() as u32);
                let node = Node { facet: facet as u32, back, part: WHOLE, parent: None, content };
                nodes.extend(ahead.then_some(node));
            }
        }
        let mut mesh = Self { facets, nodes, roots, elements: Vec::new(), places: Vec::new(), convex };
        mesh.number(scene);
        mesh
    }

    /// The elements.
    pub fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// Whether no surface can hide one from another.
    pub fn is_convex(&self) -> bool {
        self.convex
    }

    /// Divides these elements, by number, into four each.
    pub fn divide(&mut self, scene: &Scene, which: &[u32]) {
        for &element in which {
            let (place, first) = (self.places[element as usize], self.nodes.len() as u32);
            let node = self.nodes[place as usize];
            let content = Content::Element(u32::MAX);
            let quarter = |i| Node { part: node.part.quarter(i), parent: Some(place), content, ..node };
            self.nodes.extend((0..QUARTERS.len()).map(quarter));
            self.nodes[place as usize].content = Content::Quarters(first);
        }
        self.number(scene);
    }

    /// Numbers the elements in the order of the trees, which keeps neighbours together.
    fn number(&mut self, scene: &Scene) {
        self.places.clear();
        let mut open: Vec<u32> = self.roots.iter().rev().flatten().copied().collect();
        while let Some(place) = open.pop() {
            match &mut self.nodes[place as usize].content {
                Content::Quarters(first) => open.extend((*first..*first + 4).rev()),
                Content::Element(number) => {
                    *number = self.places.len() as u32;
                    self.places.push(place);
                }
            }
        }
        self.elements = self.places.par_iter().map(|&place| self.element(scene, &self.nodes[place as usize])).collect();
    }

    fn element(&self, scene: &Scene, node: &Node) -> Element {
        let (facet, part) = (&self.facets[node.facet as usize], node.part);
        let whole = Panel::new(facet.triangle.0.map(Vec3::as_dvec3), facet.ng.as_dvec3());
        let corners = [DVec2::ZERO, DVec2::X, DVec2::Y].map(|corner| whole.point(part.point(corner)));
        let normal = whole.normal * if node.back { -1.0 } else { 1.0 };
        let towards = -normal.as_vec3();
        let (mut reflected, mut emitted) = ([0.0; 3], [[0.0; 3]; 3]);
        for (at, weight) in SIX {
            let b = part.point(at).as_vec2();
            let it = scene.on_facet(node.facet as usize, facet, vec2(b.x, b.y), towards);
            add(&mut reflected, albedo(&it), weight);
            let radiosity = scene.le(&it, -towards);
            for (sum, function) in emitted.iter_mut().zip(functions::<3>(at)) {
                add(sum, radiosity, weight * function * PI);
            }
        }
        let panel = Panel::new(corners, normal);
        Element { panel, facet: node.facet as usize, part, albedo: reflected, emitted }
    }

    /// The triangle of an element.
    pub fn facet(&self, element: &Element) -> &Facet {
        &self.facets[element.facet]
    }

    /// The element on a side of a triangle at these barycentric coordinates, and the coordinates there; `None` where no light arrives.
    pub fn find(&self, facet: usize, back: bool, at: DVec2) -> Option<(usize, DVec2)> {
        let (mut place, mut at) = (self.roots[2 * facet + usize::from(back)]?, at);
        loop {
            match self.nodes[place as usize].content {
                Content::Element(number) => return Some((number as usize, at)),
                Content::Quarters(first) => {
                    let (quarter, inside) = quarter_of(at);
                    (place, at) = (first + quarter as u32, inside);
                }
            }
        }
    }

    /// What is known of a function from within the quarters of each triangle that was divided: `of_quarters` makes the value of the
    /// whole of theirs. Elements first have their own.
    pub fn gathered<T: Copy>(&self, own: impl Fn(usize) -> T, of_quarters: impl Fn([T; 4]) -> T) -> Gathered<'_, T> {
        let mut values: Vec<Option<T>> = vec![None; self.nodes.len()];
        // Quarters come after what they are quarters of.
        for place in (0..self.nodes.len()).rev() {
            values[place] = match self.nodes[place].content {
                Content::Element(number) => Some(own(number as usize)),
                Content::Quarters(first) => {
                    let of = |i: usize| values[first as usize + i];
                    match [of(0), of(1), of(2), of(3)] {
                        [Some(a), Some(b), Some(c), Some(d)] => Some(of_quarters([a, b, c, d])),
                        _ => None,
                    }
                }
            };
        }
        Gathered { mesh: self, values }
    }
}

/// Values of all triangles and their parts.
pub struct Gathered<'m, T> {
    mesh: &'m Mesh,
    values: Vec<Option<T>>,
}

impl<T: Copy> Gathered<'_, T> {
    /// The value of the triangle that an element is a quarter of, and which quarter it is; `None` if it is whole.
    pub fn around(&self, element: usize) -> Option<(T, usize)> {
        let place = self.mesh.places[element];
        let parent = self.mesh.nodes[place as usize].parent?;
        let Content::Quarters(first) = self.mesh.nodes[parent as usize].content else { return None };
        Some((self.values[parent as usize]?, (place - first) as usize))
    }
}

fn add(sum: &mut [f64; 3], value: Spectrum, weight: f64) {
    sum.iter_mut().zip(value.to_array()).for_each(|(sum, value)| *sum += f64::from(value) * weight);
}

/// How far vertices lie at the most behind a facet's plane, as a negative number, and ahead of it \[m\].
fn heights(facet: &Facet, all: &[Facet]) -> (f64, f64) {
    let (origin, ng) = (facet.triangle.0[0].as_dvec3(), facet.ng.as_dvec3());
    let corners = all.iter().flat_map(|other| other.triangle.0);
    let height = |corner: Vec3| -> f64 { ng.dot(corner.as_dvec3() - origin) };
    corners.map(height).fold((0.0f64, 0.0f64), |(low, high), h| (low.min(h), high.max(h)))
}

/// A point of an element in the scene, as rays leave it.
pub fn surface_point(facet: &Facet, element: &Element, at: DVec2) -> scenes::SurfacePoint {
    let b = element.part.point(at);
    facet.triangle.point_off_edges([b.x, b.y], facet.ng)
}
