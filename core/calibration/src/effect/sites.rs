//! Where a written effect acts: its arguments read as joints, targets, axes or surfaces of a model.

use super::identity::{Channel, EffectId, EffectNameError, Quantity, Site, joint_names};
use super::kind::{Kind, SiteKind};
use crate::arm_model::Model;
use crate::suggestion::suggestion;

/// A kind of effect as it was written, about to be given its sites.
pub(super) struct Sites<'a> {
    kind: &'a Kind,
    text: &'a str,
    model: &'a Model,
}

type Found = Result<Vec<EffectId>, EffectNameError>;

impl<'a> Sites<'a> {
    pub(super) fn new(kind: &'a Kind, text: &'a str, model: &'a Model) -> Self {
        Self { kind, text, model }
    }

    /// The effects that these arguments mean; `*` and none mean all.
    pub(super) fn at(&self, arguments: &[&str]) -> Found {
        let model = self.model;
        match (self.kind.sites, arguments) {
            (SiteKind::Base, [] | ["base"]) => self.ids([Site::Base]),
            (SiteKind::Instrument, [] | ["instrument"]) => self.ids([Site::Instrument]),
            (SiteKind::Sensor, [] | ["sensor"]) => self.ids([Site::Sensor]),
            (SiteKind::Joints, []) => self.ids(self.joints("*")?),
            (SiteKind::Joints, [name]) => self.ids(self.joints(name)?),
            (SiteKind::JointsAndOrder | SiteKind::JointsAndPieces, [name, order]) => {
                self.with_order(name, order)
            }
            (SiteKind::JointPairs, [first, other]) => self.pairs(first, other),
            (SiteKind::JointsAndQuantity, [name, of]) => self.with_quantity(name, of),
            (SiteKind::Targets, [] | ["*"]) => self.ids((0..model.targets.len()).map(Site::Target)),
            (SiteKind::Targets, [name]) => {
                let known = model.targets.iter().map(|target| target.name.as_str());
                self.named("a target", name, known, model.target_position(name))
                    .map(|one| vec![self.id(Site::Target(one))])
            }
            (SiteKind::Surfaces, [] | ["*"]) => self.ids((0..model.surfaces.len()).map(Site::Surface)),
            (SiteKind::Surfaces, [name]) => {
                let known = model.surfaces.iter().map(|surface| surface.name.as_str());
                self.named("a surface", name, known, model.surface_position(name))
                    .map(|one| vec![self.id(Site::Surface(one))])
            }
            (SiteKind::Readings, [] | ["*"]) => self.ids(Channel::all().map(Site::Reading)),
            (SiteKind::Readings, [name]) => {
                // Their order in the list is all that `named` needs to know.
                let channel = Channel::by_name(name);
                let known = Channel::all().map(Channel::name);
                self.named("a reading", name, known, channel.map(Channel::index))?;
                self.ids(channel.map(Site::Reading))
            }
            (SiteKind::Axes, [] | ["*"]) => self.ids((0..3).map(Site::Axis)),
            (SiteKind::Axes, [name]) => {
                let axis = ["x", "y", "z"].iter().position(|axis| axis == name);
                self.ids([Site::Axis(axis.ok_or_else(|| self.malformed())?)])
            }
            _ => Err(self.malformed()),
        }
    }

    fn id(&self, site: Site) -> EffectId {
        EffectId::at(self.kind.name, site)
    }

    fn ids(&self, sites: impl IntoIterator<Item = Site>) -> Found {
        Ok(sites.into_iter().map(|site| self.id(site)).collect())
    }

    fn with_order(&self, name: &str, order: &str) -> Found {
        let order: f64 = order.trim_start_matches("n=").trim().parse().map_err(|_| self.malformed())?;
        if !(order.is_finite() && order > 0.0) {
            return Err(self.malformed());
        }
        let joints = self.joints(name)?;
        Ok(joints.into_iter().map(|site| EffectId { order: Some(order), ..self.id(site) }).collect())
    }

    fn with_quantity(&self, name: &str, of: &str) -> Found {
        let of = Quantity::by_name(of).ok_or_else(|| self.malformed())?;
        let joints = self.joints(name)?;
        Ok(joints.into_iter().map(|site| EffectId { of: Some(of), ..self.id(site) }).collect())
    }

    /// Pairs of joints; with a wildcard, no joint is paired with itself.
    fn pairs(&self, first: &str, other: &str) -> Found {
        let (firsts, others) = (self.joints(first)?, self.joints(other)?);
        // With a wildcard the pair of a joint with itself is left out; written by name it is refused, with a reason.
        let has_wildcard = first == "*" || other == "*";
        let mut found = Vec::new();
        for site in firsts {
            for with in others.iter().filter(|with| !(has_wildcard && **with == site)) {
                found.push(EffectId { with: with.joint(), ..self.id(site) });
            }
        }
        Ok(found)
    }

    /// One joint by its name, or all of them.
    fn joints(&self, name: &str) -> Result<Vec<Site>, EffectNameError> {
        let chain = &self.model.chain;
        if name == "*" {
            return Ok((0..chain.len()).map(Site::Joint).collect());
        }
        let joint = self.named("a joint", name, joint_names(chain), chain.position_of(name))?;
        Ok(vec![Site::Joint(joint)])
    }

    /// What a name was found to be, or an error that offers what may have been meant.
    fn named<'n>(
        &self,
        expected: &'static str,
        name: &str,
        known: impl Iterator<Item = &'n str>,
        found: Option<usize>,
    ) -> Result<usize, EffectNameError> {
        found.ok_or_else(|| EffectNameError::UnknownSite {
            effect: self.kind.name.to_owned(),
            expected,
            site: name.to_owned(),
            suggestion: suggestion(name, known),
        })
    }

    fn malformed(&self) -> EffectNameError {
        let readings = || format!("({})", Channel::all().map(Channel::name).collect::<Vec<_>>().join("|"));
        let arguments = match self.kind.sites {
            SiteKind::Joints => "(joint)",
            SiteKind::JointsAndOrder => "(joint, periods a turn)",
            SiteKind::JointsAndPieces => "(joint, pieces)",
            SiteKind::JointPairs => "(joint, other joint)",
            SiteKind::JointsAndQuantity => "(joint, zero|length|offset)",
            SiteKind::Targets => "(p1)",
            SiteKind::Axes => "(x|y|z)",
            SiteKind::Surfaces => "(surface)",
            SiteKind::Readings => &readings(),
            SiteKind::Base | SiteKind::Instrument | SiteKind::Sensor => "",
        };
        EffectNameError::Malformed {
            text: self.text.to_owned(),
            example: format!("{}{arguments}", self.kind.name),
        }
    }
}
