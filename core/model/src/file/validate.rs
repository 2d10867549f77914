//! From what was typed to what is true: names resolved, units turned into mm and rad, impossible values refused.

use std::path::Path;

use nalgebra::{Rotation3, Vector3};
use plumb_document::{FileKind, read_text};
use plumb_kinematics::{Chain, Convention, Joint, Mass, Motion};
use serde_yaml::{Location, Spanned};

use super::contradiction::contradiction;
use super::error::{ModelFileError, Place, suggestion};
use super::model::{
    AddedEffect, Base, Frame, Level, MeasuredFrom, Model, Noise, Revision, Surface, SurfaceShape, Target,
    Touch, TouchDistance,
};
use super::raw::{
    RawConvention, RawEffect, RawJoint, RawLevel, RawMeasuredFrom, RawModel, RawSensor, RawSide, RawSurface,
    RawTouch, RawValuedEffect, RawVolume,
};
use super::sensor::Sensor;
use super::syntax;
use super::urdf;
use crate::effect;

impl Model {
    /// Reads and checks a model file.
    ///
    /// # Errors
    /// See [`ModelFileError`]; the message names file, line and column.
    pub fn read(path: &Path) -> Result<Self, ModelFileError> {
        let shown = path.display().to_string();
        let text = read_text(path, FileKind::MODEL)
            .map_err(|cause| ModelFileError::Open { path: shown.clone(), cause: cause.into() })?;
        Self::parse(&shown, &text)
    }

    /// Reads and checks a model from text; `source` is the name used in messages.
    ///
    /// # Errors
    /// See [`ModelFileError`].
    pub fn parse(source: &str, text: &str) -> Result<Self, ModelFileError> {
        let checker = Checker { path: source };
        let raw: RawModel = serde_yaml::from_str(text).map_err(|error| checker.syntax(&error, text))?;
        checker.model(raw)
    }
}

pub(super) struct Checker<'a> {
    pub(super) path: &'a str,
}

pub(super) type Checked<T> = Result<T, ModelFileError>;

impl Checker<'_> {
    pub(super) fn place(&self, location: &Location) -> Place {
        Place { path: self.path.to_owned(), line: location.line(), column: location.column() }
    }

    pub(super) fn fail<T>(&self, location: &Location, reason: impl Into<String>) -> Checked<T> {
        Err(ModelFileError::Meaning { place: self.place(location), reason: reason.into() })
    }

    fn syntax(&self, error: &serde_yaml::Error, text: &str) -> ModelFileError {
        let place = error.location().map(|location| self.place(&location)).unwrap_or_default();
        let place = if place.path.is_empty() { Place { path: self.path.to_owned(), ..place } } else { place };
        let reason = syntax::reason(error, text, &place);
        ModelFileError::Syntax { place, reason }
    }

    fn model(&self, raw: RawModel) -> Checked<Model> {
        let described = self.described(&raw)?;
        let chain = match &described {
            Some(arm) => self.described_chain(&raw, arm)?,
            None => self.chain(&raw)?,
        };
        let typed_masses = self.masses(&raw, &chain)?;
        let base = Base::new(raw.base.xyz_mm, raw.base.rpy_deg.map(f64::to_radians), raw.base.free);
        let targets = self.targets(&raw)?;
        let (masses, base, targets) = match &described {
            Some(arm) => {
                let masses = if raw.links.is_empty() { arm.masses.clone() } else { typed_masses };
                (masses, urdf::on_root(base, arm), urdf::at_tip(targets, arm))
            }
            None => (typed_masses, base, targets),
        };
        let mut model = Model {
            arm: raw.arm.clone(),
            masses,
            chain,
            base,
            targets,
            free: Vec::new(),
            effects: Vec::new(),
            fitted: Vec::new(),
            surfaces: self.surfaces(&raw)?,
            measured_from: match raw.measured_from {
                RawMeasuredFrom::Instrument => MeasuredFrom::Instrument,
                RawMeasuredFrom::World => MeasuredFrom::World,
            },
            gravity: None,
            working_volume: raw
                .working_volume
                .as_ref()
                .map(|volume| self.working_volume(volume))
                .transpose()?,
            levels: Vec::new(),
            sensor: raw.sensor.as_ref().map(|sensor| self.sensor(sensor)).transpose()?,
            noise: self.noise(&raw)?,
            touch: None,
            definitions: Vec::new(),
            revision: raw.revision.as_ref().map(|revision| Revision {
                number: revision.number,
                of: revision.of.clone(),
                did: revision.did.clone(),
                data: revision.data.clone(),
                parent: revision.parent,
                rms: revision.rms_mm,
            }),
        };
        if let Some(gravity) = &raw.gravity {
            model.gravity = Some(self.direction(gravity)?);
        }
        if let Some(arm) = &described {
            model.gravity = urdf::gravity(&model, arm);
        }
        model.levels = self.levels(&raw, &model.chain)?;
        model.touch = raw.touch.as_ref().map(|touch| self.touch(touch, &model)).transpose()?;
        self.definitions(&raw.define, &mut model)?;
        for text in &raw.free {
            if let Err(error) = effect::expand(&text.value, &model) {
                return self.fail(&text.referenced, error.to_string());
            }
            model.free.push(text.value.clone());
        }
        for raw in &raw.effects {
            let effects = self.effects(raw, &model)?;
            model.effects.extend(effects);
        }
        for raw in &raw.fitted {
            let effects = self.effects(raw, &model)?;
            model.fitted.extend(effects);
        }
        Ok(model)
    }

    fn chain(&self, raw: &RawModel) -> Checked<Chain> {
        let convention = match raw.convention.value {
            RawConvention::Proximal => Convention::Proximal,
            RawConvention::Distal | RawConvention::Urdf { .. } => Convention::Distal,
        };
        let joints: Checked<Vec<Joint>> = raw.joints.iter().map(|joint| self.joint(joint)).collect();
        let typed = joints?;
        let seen = |index: usize, name: &str| typed.iter().take(index).any(|other| other.name == name);
        let mut joints = typed.clone();
        for (index, joint) in raw.joints.iter().enumerate() {
            if let Some(less) = &joint.less {
                let names = raw.joints.iter().take(index).map(|joint| joint.name.value.as_str());
                let Some(drive) = names.clone().position(|name| name == less.value) else {
                    let reason = format!(
                        "there is no joint `{}` before it{}",
                        less.value,
                        suggestion(&less.value, names)
                    );
                    return self.fail(&less.referenced, reason);
                };
                if let Some(joint) = joints.get_mut(index) {
                    joint.less = Some(drive);
                }
            }
            if seen(index, &joint.name.value) {
                return self
                    .fail(&joint.name.referenced, format!("joint `{}` is named twice", joint.name.value));
            }
        }
        Chain::new(convention, joints)
            .or_else(|error| self.fail(&raw.convention.referenced, error.to_string()))
    }

    pub(super) fn joint(&self, raw: &RawJoint) -> Checked<Joint> {
        let name = &raw.name;
        if name.value.trim().is_empty() || name.value.contains(['(', ')', ',', '*']) {
            return self.fail(&name.referenced, format!("`{}` cannot be a joint's name", name.value));
        }
        let numbers = [raw.a_mm, raw.alpha_deg, raw.d_mm, raw.theta_deg];
        if numbers.iter().any(|number| !number.is_finite()) {
            return self
                .fail(&name.referenced, format!("joint `{}` has a number that is not finite", name.value));
        }
        let mut joint = Joint::turning(
            &name.value,
            raw.a_mm,
            raw.alpha_deg.to_radians(),
            raw.d_mm,
            raw.theta_deg.to_radians(),
        );
        if raw.slides {
            joint.motion = Motion::Slides;
            joint.limits = (-1e6, 1e6);
        }
        let limits = match (raw.slides, &raw.limits_deg, &raw.limits_mm) {
            (false, Some(limits), None) => Some((limits, 1.0_f64.to_radians())),
            (true, None, Some(limits)) => Some((limits, 1.0)),
            (_, None, None) => None,
            (true, Some(limits), _) => {
                return self.fail(&limits.referenced, "a joint that slides has limits_mm");
            }
            (false, _, Some(limits)) => {
                return self.fail(&limits.referenced, "a joint that turns has limits_deg");
            }
        };
        if let Some((limits, scale)) = limits {
            let [low, high] = limits.value;
            if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
                return self.fail(
                    &limits.referenced,
                    format!("limits [{low}, {high}] hold no pose; the lower comes first"),
                );
            }
            joint.limits = (low * scale, high * scale);
        }
        if let Some(sign) = &raw.sign {
            if sign.value.abs() != 1.0 {
                return self.fail(&sign.referenced, format!("a sign is 1 or -1, not {}", sign.value));
            }
            joint.sign = sign.value;
        }
        if let Some(ratio) = &raw.gear_ratio {
            if !ratio.value.is_finite() || ratio.value == 0.0 {
                return self.fail(&ratio.referenced, format!("a gear ratio of {} cannot be", ratio.value));
            }
            joint.gear_ratio = Some(ratio.value);
        }
        Ok(joint)
    }

    pub(super) fn joint_named(&self, name: &Spanned<String>, chain: &Chain) -> Checked<usize> {
        chain.position_of(&name.value).map_or_else(
            || {
                let names = chain.joints.iter().map(|joint| joint.name.as_str());
                self.fail(
                    &name.referenced,
                    format!("there is no joint `{}`{}", name.value, suggestion(&name.value, names)),
                )
            },
            Ok,
        )
    }

    fn masses(&self, raw: &RawModel, chain: &Chain) -> Checked<Vec<Mass>> {
        let mut masses = Vec::new();
        for link in &raw.links {
            let after = self.joint_named(&link.after, chain)?;
            if !link.mass_kg.value.is_finite() || link.mass_kg.value < 0.0 {
                return self.fail(
                    &link.mass_kg.referenced,
                    format!("a mass of {} kg cannot be", link.mass_kg.value),
                );
            }
            masses.push(Mass { after, mass: link.mass_kg.value, centre: Vector3::from(link.centre_mm) });
        }
        Ok(masses)
    }

    fn targets(&self, raw: &RawModel) -> Checked<Vec<Target>> {
        let mut targets: Vec<Target> = Vec::new();
        for (name, target) in &raw.targets.0 {
            let number = name.value.strip_prefix('p').and_then(|digits| digits.parse::<u32>().ok());
            if number.is_none_or(|number| number == 0) {
                let reason =
                    format!("a target is called p1, p2, ... as in the table's columns, not `{}`", name.value);
                return self.fail(&name.referenced, reason);
            }
            targets.push(Target {
                name: name.value.clone(),
                xyz: Vector3::from(target.xyz_mm),
                free: target.free,
            });
        }
        Ok(targets)
    }

    fn direction(&self, typed: &Spanned<[f64; 3]>) -> Checked<Vector3<f64>> {
        let vector = Vector3::from(typed.value);
        match vector.try_normalize(1e-12) {
            Some(unit) if unit.iter().all(|part| part.is_finite()) => Ok(unit),
            _ => self.fail(&typed.referenced, "this vector has no direction; write for example [0, 0, 1]"),
        }
    }

    fn working_volume(&self, typed: &Spanned<RawVolume>) -> Checked<[(f64, f64); 3]> {
        let RawVolume { x_mm, y_mm, z_mm } = typed.value;
        let spans = [x_mm, y_mm, z_mm].map(|[low, high]| (low, high));
        match spans.iter().all(|(low, high)| low.is_finite() && high.is_finite() && low < high) {
            true => Ok(spans),
            false => self.fail(
                &typed.referenced,
                "each of x_mm, y_mm and z_mm needs a least and a greater number, such as [100, 300]",
            ),
        }
    }

    fn surfaces(&self, raw: &RawModel) -> Checked<Vec<Surface>> {
        let surface = |(name, raw): &(Spanned<String>, RawSurface)| {
            let shape = match (&raw.plane, &raw.line, &raw.sphere, &raw.point_mm) {
                (Some(plane), None, None, None) => {
                    SurfaceShape::Plane { normal: self.direction(&plane.normal)?, offset: plane.offset_mm }
                }
                (None, Some(line), None, None) => SurfaceShape::Line {
                    point: Vector3::from(line.point_mm),
                    direction: self.direction(&line.direction)?,
                },
                (None, None, Some(sphere), None) => {
                    SurfaceShape::Sphere { centre: Vector3::from(sphere.centre_mm), radius: sphere.radius_mm }
                }
                (None, None, None, Some(point)) => SurfaceShape::Point { point: Vector3::from(*point) },
                _ => {
                    return self
                        .fail(&name.referenced, "a surface is one of `plane`, `line`, `sphere`, `point_mm`");
                }
            };
            let light = raw.line.as_ref().and_then(|line| line.light);
            let light = light.map(|side| if side == RawSide::Left { 1.0 } else { -1.0 });
            Ok(Surface { name: name.value.clone(), shape, free: raw.free, light })
        };
        raw.surfaces.0.iter().map(surface).collect()
    }

    fn sensor(&self, raw: &Spanned<RawSensor>) -> Checked<Sensor> {
        let RawSensor { working_mm, peak_mm, spot_mm, hysteresis_percent, dark_percent } = raw.value;
        let sensor = Sensor {
            working: working_mm,
            peak: peak_mm,
            spot: spot_mm,
            hysteresis: hysteresis_percent / 100.0,
            dark: dark_percent / 100.0,
        };
        match sensor.fault() {
            Some(reason) => self.fail(&raw.referenced, reason),
            None => Ok(sensor),
        }
    }

    /// The one under `level:`, which has no name, and those under `levels:`, which do.
    fn levels(&self, raw: &RawModel, chain: &Chain) -> Checked<Vec<Level>> {
        let named = raw.levels.0.iter().map(|(name, level)| (Some(name.value.clone()), level));
        let all = raw.level.iter().map(|level| (None, level)).chain(named);
        all.map(|(name, level)| self.level(name, level, chain)).collect()
    }

    fn level(&self, name: Option<String>, raw: &RawLevel, chain: &Chain) -> Checked<Level> {
        let frame = match &raw.after {
            None => Frame::After(chain.len().saturating_sub(1)),
            Some(name) if name.value == "base" => Frame::Base,
            Some(name) if name.value == "flange" && chain.position_of("flange").is_none() => {
                Frame::After(chain.len().saturating_sub(1))
            }
            Some(name) => Frame::After(self.joint_named(name, chain)?),
        };
        let [roll, pitch, yaw] = raw.rpy_deg.map(f64::to_radians);
        Ok(Level { name, frame, rotation: Rotation3::from_euler_angles(roll, pitch, yaw) })
    }

    fn noise(&self, raw: &RawModel) -> Checked<Noise> {
        let mut noise = Noise::default();
        for (key, value) in &raw.noise.0 {
            if !(value.value.is_finite() && value.value > 0.0) {
                return self.fail(
                    &value.referenced,
                    format!("a noise of {} cannot be; leave it out if unknown", value.value),
                );
            }
            let sigma = value.value;
            match key.value.as_str() {
                "height_mm" | "on_mm" => noise.height = Some(sigma),
                "tilt_deg" => noise.tilt = Some(sigma.to_radians()),
                "distance_mm" => noise.distance = Some(sigma),
                "touch_mm" => noise.touch = Some(sigma),
                name => match name.strip_suffix("_mm") {
                    Some(target) if raw.targets.0.iter().any(|(known, _)| known.value == target) => {
                        noise.positions.push((target.to_owned(), sigma));
                    }
                    _ => {
                        let known = ["p1_mm", "height_mm", "tilt_deg", "distance_mm", "touch_mm"];
                        return self.fail(
                            &key.referenced,
                            format!("no noise `{name}` is known{}", suggestion(name, known)),
                        );
                    }
                },
            }
        }
        Ok(noise)
    }

    fn touch(&self, raw: &RawTouch, model: &Model) -> Checked<Touch> {
        let target = match &raw.p {
            None => "p1".to_owned(),
            Some(name) if model.target_position(&name.value).is_some() => name.value.clone(),
            Some(name) => {
                let names = model.targets.iter().map(|target| target.name.as_str());
                let reason = format!("there is no target `{}`{}", name.value, suggestion(&name.value, names));
                return self.fail(&name.referenced, reason);
            }
        };
        let mut distances = Vec::new();
        for distance in &raw.distances {
            if !(distance.mm.value.is_finite() && distance.mm.value >= 0.0) {
                return self.fail(
                    &distance.mm.referenced,
                    format!("a distance of {} mm cannot be", distance.mm.value),
                );
            }
            distances
                .push(TouchDistance { between: distance.between.value.clone(), length: distance.mm.value });
        }
        if let Some((entry, reason)) = contradiction(&distances)
            && let Some(raw) = raw.distances.get(entry)
        {
            return self.fail(&raw.between.referenced, reason);
        }
        Ok(Touch { target, distances })
    }

    fn effects(&self, raw: &Spanned<RawEffect>, model: &Model) -> Checked<Vec<AddedEffect>> {
        let at_zero = |id: effect::EffectId, location: &Location| match effect::build(&id, model) {
            Ok(built) => Ok(AddedEffect { id, values: vec![0.0; built.parameters().len()] }),
            Err(error) => self.fail(location, error.to_string()),
        };
        let location = &raw.referenced;
        match &raw.value {
            RawEffect::Named(text) => match effect::expand(text, model) {
                Ok(ids) => ids.into_iter().map(|id| at_zero(id, location)).collect(),
                Err(error) => self.fail(location, error.to_string()),
            },
            RawEffect::Valued(raw) => {
                let mut ids = match effect::expand(&written(raw), model) {
                    Ok(ids) => ids,
                    Err(error) => return self.fail(location, error.to_string()),
                };
                for id in &mut ids {
                    id.inner = raw.searched;
                }
                ids.into_iter().map(|id| self.with_values(at_zero(id, location)?, raw, model)).collect()
            }
        }
    }

    fn with_values(
        &self,
        mut added: AddedEffect,
        raw: &RawValuedEffect,
        model: &Model,
    ) -> Checked<AddedEffect> {
        let built = effect::build(&added.id, model)
            .or_else(|error| self.fail(&raw.effect.referenced, error.to_string()))?;
        for (name, value) in &raw.values.0 {
            let Some(index) = built.parameters().iter().position(|parameter| parameter.name == name.value)
            else {
                let names = built.parameters().iter().map(|parameter| parameter.name.as_str());
                let reason = format!(
                    "`{}` has no value `{}`{}",
                    added.id.name,
                    name.value,
                    suggestion(&name.value, names)
                );
                return self.fail(&name.referenced, reason);
            };
            if !value.value.is_finite() {
                return self.fail(&value.referenced, format!("`{}` is not finite", name.value));
            }
            let factor = built.parameters().get(index).map_or(1.0, |parameter| parameter.unit.factor);
            if let Some(slot) = added.values.get_mut(index) {
                *slot = value.value / factor;
            }
        }
        Ok(added)
    }
}

/// An effect's keys as one text, as it would be written by itself.
fn written(raw: &RawValuedEffect) -> String {
    let mut arguments = Vec::new();
    arguments.extend(raw.place.as_ref().map(|place| place.value.clone()));
    arguments.extend(raw.with.as_ref().map(|with| with.value.clone()));
    arguments.extend(raw.n.map(|order| order.to_string()));
    arguments.extend(raw.of.as_ref().map(|of| of.value.clone()));
    match arguments.is_empty() {
        true => raw.effect.value.clone(),
        false => format!("{}({})", raw.effect.value, arguments.join(", ")),
    }
}
