//! What an image is taken apart into besides its orders: strategies, light groups, path classes.
//!
//! Every part is a layer of the film, behind those of the orders, and has means and variances as they have. Light that is not asked
//! to be taken apart costs nothing: methods are compiled once for films without parts.

use crate::contribution::Technique;
use crate::lpe::{Classifier, Expression};
use crate::measurement::Layer;
use scenes::{EmitterId, LightGroup, Scene};

/// The parts that are asked for.
#[derive(Clone, Debug, Default)]
pub struct PartSettings {
    /// Every strategy `(s, t)`: what it contributes, unweighted and weighted, and its weights; and what merging contributes, order by
    /// order.
    pub strategies: bool,
    /// Every light group, whole and order by order.
    pub groups: bool,
    /// Every path class.
    pub classes: Vec<PathClass>,
}

/// A path class: a light-path expression and what its image is called.
#[derive(Clone, Debug)]
pub struct PathClass {
    /// Name of its layer.
    pub name: String,
    /// Which paths it has.
    pub expression: Expression,
}

/// What is kept of a strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Its share of the image.
    Weighted,
    /// What it would estimate alone.
    Raw,
    /// The weights of its contributions. The three channels are the sum of weights, the number of contributions, and the sum of
    /// the two, whose variance tells the covariance of the others.
    Weights,
}

/// One image that is kept apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Part {
    /// Of a strategy.
    Strategy {
        /// Light vertices.
        s: usize,
        /// Camera vertices.
        t: usize,
        /// What of it.
        quantity: Quantity,
    },
    /// Of all that was merged in an order, whose strategies are not told apart.
    Merged {
        /// The order.
        order: usize,
    },
    /// Of a light group; of one of the series' layers, or of all of them.
    Group {
        /// Its name.
        name: String,
        /// Which layer.
        layer: Option<Layer>,
    },
    /// Of a path class.
    Class {
        /// Its name.
        name: String,
    },
}

impl Part {
    /// Whether it is a strategy's.
    pub fn is_strategy(&self) -> bool {
        matches!(self, Part::Strategy { .. })
    }

    /// The name of its layer in image files: `s02_t03`, `s02_t03_raw`, `s02_t03_weight`, `merged_order02`,
    /// `group_key`, `group_key_order02`,
    /// `lpe_caustics`.
    pub fn name(&self, max_order: usize) -> String {
        match self {
            Part::Strategy { s, t, quantity } => {
                let strategy = if max_order > 97 { format!("s{s:03}_t{t:03}") } else { format!("s{s:02}_t{t:02}") };
                match quantity {
                    Quantity::Weighted => strategy,
                    Quantity::Raw => strategy + "_raw",
                    Quantity::Weights => strategy + "_weight",
                }
            }
            Part::Merged { order } => format!("merged_{}", Layer::Order(*order).name(max_order)),
            Part::Group { name, layer: None } => format!("group_{name}"),
            Part::Group { name, layer: Some(layer) } => format!("group_{name}_{}", layer.name(max_order)),
            Part::Class { name } => format!("lpe_{name}"),
        }
    }
}

/// The parts of a render and where the film has them.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    list: Vec<Part>,
    /// By order and light vertices: the first of the layers of the strategy, or what stands for none.
    strategies: Vec<Vec<Option<u32>>>,
    /// By order: the layer of what was merged, or what stands for none.
    merged: Vec<Option<u32>>,
    /// By emitter: the first layer of its group; empty where groups are not asked for.
    groups: Vec<u32>,
    /// The first layer of the classes.
    classes: u32,
    classifier: Option<Classifier>,
}

impl Parts {
    /// The parts of a render whose film has these layers, by a method that has the strategies that `makes` says.
    ///
    /// # Errors
    /// A sentence, if the expressions are too many for one automaton or mention what the scene does not have.
    pub fn new(
        settings: &PartSettings,
        scene: &Scene,
        layers: &[Layer],
        makes: impl Fn(Technique) -> bool,
    ) -> Result<Self, String> {
        let mut parts = Self::default();
        let place = |parts: &Self| (layers.len() + parts.list.len()) as u32;
        for order in layers.iter().filter(|_| settings.strategies).filter_map(|layer| layer.order()) {
            parts.strategies.resize(order + 1, Vec::new());
            for s in 0..=order + 1 {
                let t = order + 2 - s;
                let made = makes(Technique::connect(s, t));
                let first = made.then(|| place(&parts));
                parts.strategies[order].push(first);
                let quantities = [Quantity::Weighted, Quantity::Raw, Quantity::Weights];
                let strategy = quantities.map(|quantity| Part::Strategy { s, t, quantity });
                parts.list.extend(strategy.into_iter().filter(|_| made));
            }
            if order > 0 && makes(Technique::merge(2, order + 1)) {
                parts.merged.resize(order + 1, None);
                parts.merged[order] = Some(place(&parts));
                parts.list.push(Part::Merged { order });
            }
        }
        if settings.groups {
            let groups = scene.labels.groups();
            parts.groups = vec![0; scene.emitters.len()];
            for (LightGroup { emitters, .. }, name) in groups.iter().zip(layer_names(&groups)) {
                emitters.iter().for_each(|emitter| parts.groups[emitter.0 as usize] = place(&parts));
                let layers = [None].into_iter().chain(layers.iter().copied().map(Some));
                parts.list.extend(layers.map(|layer| Part::Group { name: name.clone(), layer }));
            }
        }
        if !settings.classes.is_empty() {
            parts.classes = place(&parts);
            parts.list.extend(settings.classes.iter().map(|class| Part::Class { name: class.name.clone() }));
            let expressions: Vec<Expression> = settings.classes.iter().map(|class| class.expression.clone()).collect();
            let classifier = Classifier::new(&expressions, &scene.labels.surfaces(), &scene.labels.emitters());
            let classifier = classifier.map_err(|error| error.to_string())?;
            if let Some(unknown) = classifier.unknown_names().first() {
                return Err(format!("{unknown}; `neumann scene` lists what there is"));
            }
            parts.classifier = Some(classifier);
        }
        Ok(parts)
    }

    /// What the film has behind its other layers.
    pub fn list(&self) -> &[Part] {
        &self.list
    }

    /// What tells path classes, where they are asked for.
    #[inline]
    pub fn classifier(&self) -> Option<&Classifier> {
        self.classifier.as_ref()
    }

    /// The layer of what a strategy contributes weighted; those of the raw estimate and of its weights follow.
    #[inline]
    pub(crate) fn strategy(&self, technique: Technique) -> Option<usize> {
        let Technique::Connect { s, .. } = technique else { return None };
        let of_order = self.strategies.get(technique.order())?;
        of_order.get(s as usize).copied().flatten().map(|layer| layer as usize)
    }

    /// The layer of what was merged in the order of a technique, if it merges.
    #[inline]
    pub(crate) fn merged(&self, technique: Technique) -> Option<usize> {
        let Technique::Merge { .. } = technique else { return None };
        self.merged.get(technique.order()).copied().flatten().map(|layer| layer as usize)
    }

    /// The layer of the group of an emitter; those of its orders follow.
    #[inline]
    pub(crate) fn group(&self, emitter: Option<EmitterId>) -> Option<usize> {
        self.groups.get(emitter?.0 as usize).map(|&layer| layer as usize)
    }

    /// The layer of a class.
    #[inline]
    pub(crate) fn class(&self, number: u32) -> usize {
        (self.classes + number) as usize
    }
}

/// What layers of groups are called: their names, as far as names of layers can be, all different.
fn layer_names(groups: &[LightGroup]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for group in groups {
        let allowed = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
        let plain: String = group.name.chars().map(allowed).collect();
        let numbered = (2..).map(|n| format!("{plain}_{n}"));
        let free = |name: &String| !names.contains(name);
        names.extend([plain.clone()].into_iter().chain(numbered).find(free));
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_have_names_of_their_own_without_dots() {
        let group = |name: &str| LightGroup { name: name.to_owned(), emitters: Vec::new() };
        let names = layer_names(&[group("key"), group("Light.001"), group("Light 001"), group("schön")]);
        assert_eq!(names, ["key", "Light_001", "Light_001_2", "sch_n"]);
        let part = Part::Group { name: "key".into(), layer: Some(Layer::Order(2)) };
        assert_eq!(part.name(8), "group_key_order02");
        assert_eq!(Part::Strategy { s: 2, t: 3, quantity: Quantity::Raw }.name(8), "s02_t03_raw");
    }
}
