//! From what was typed to what is true: names resolved, units turned into mm and rad, impossible values refused.

use std::path::Path;

use nalgebra::{Rotation3, Vector3};
use plumb_document::{
    DocumentKind, FileKind, FileProblems, Problems, Span, Spanned, parse_as, read_document, typed,
};
use plumb_kinematics::{Chain, Convention, Joint, Mass, Motion};

use super::contradiction::contradiction;
use super::error::{FilePosition, ModelFileError};
use super::parts::{measured_from, revision};
use super::raw::{
    RawClaim, RawConvention, RawEffect, RawJoint, RawLevel, RawLink, RawModel, RawSensor, RawSide,
    RawSurface, RawTouch, RawValuedEffect, RawVolume,
};
use super::urdf_frames;
use crate::arm_model::Sensor;
use crate::arm_model::SurfaceShape;
use crate::arm_model::{
    AddedEffect, Correction, Frame, Level, Model, Surface, Target, Touch, TouchDistance, ValuePrior,
};
use crate::effect::{self, Effect, EffectId};
use crate::suggestion::suggestion;
use crate::table::Table;

impl Model {
    /// Reads and checks a model file.
    ///
    /// # Errors
    /// [`ModelFileError`]: every mistake with file, line and column.
    pub fn read(path: &Path) -> Result<Self, ModelFileError> {
        let text = read_document(path, FileKind::MODEL)?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// Reads and checks a model from text; `source` is the name used in messages.
    ///
    /// # Errors
    /// See [`ModelFileError`].
    pub fn parse(source: &str, text: &str) -> Result<Self, ModelFileError> {
        let (file, problems) = (Path::new(source), Problems::default());
        // Said in one sentence: what a reader of YAML has to say of a table is no help.
        if let Some(what) = no_model(text) {
            return Err(FileProblems::whole_file(file, what.0, what.1).into());
        }
        let root = parse_as(DocumentKind::Model, file, text, &problems)?;
        let raw: Option<RawModel> = typed(&root, "a model", &problems);
        let model = raw.and_then(|raw| Checker { path: source, problems: &problems }.model(raw).ok());
        problems.into_result(file, text)?;
        model.ok_or_else(|| FileProblems::whole_file(file, "this is no model", "").into())
    }
}

/// What is wrong with a text that is no model at all, and what would be right.
fn no_model(text: &str) -> Option<(&'static str, &'static str)> {
    if text.trim().is_empty() {
        return Some(("the file is empty", "`plumb model template ROBOT` writes one to fill in"));
    }
    Table::parse("", text).is_ok().then_some((
        "this is a table of measurements, no model",
        "the model file comes first, the table after --data",
    ))
}

/// Checks one file; what is wrong goes among `problems`.
pub(super) struct Checker<'a> {
    pub(super) path: &'a str,
    pub(super) problems: &'a Problems,
}

/// There is no value, and the reason is among the problems.
#[derive(Debug)]
pub(super) struct Refused;

pub(super) type Checked<T> = Result<T, Refused>;

impl Checker<'_> {
    /// The location for messages of a later time, when the formula that is there is worked out.
    pub(super) fn location(&self, span: &Span) -> FilePosition {
        FilePosition { path: self.path.to_owned(), line: span.line as u64, column: span.column as u64 }
    }

    /// Reports what is wrong at a place. What follows `; ` says what would be right.
    pub(super) fn fail<T>(&self, span: &Span, reason: impl Into<String>) -> Checked<T> {
        let reason = reason.into();
        let (message, help) = reason.rsplit_once("; ").unwrap_or((&reason, ""));
        self.problems.add(*span, message, help);
        Err(Refused)
    }

    /// Every part is checked, also behind one that is wrong; effects only where the names they may use are known.
    fn model(&self, raw: RawModel) -> Checked<Model> {
        // Effects name joints and targets: behind a mistake in these they would be accused of it.
        let before = self.problems.len();
        let described = self.described(&raw);
        let chain = match &described {
            Ok(Some(arm)) => self.described_chain(&raw, arm),
            Ok(None) => self.chain(&raw),
            Err(Refused) => Err(Refused),
        };
        let targets = self.targets(&raw);
        let surfaces = self.surfaces(&raw);
        let working_volume =
            raw.working_volume.as_ref().map(|volume| self.working_volume(volume)).transpose();
        let sensor = raw.sensor.as_ref().map(|sensor| self.sensor(sensor)).transpose();
        let noise = self.noise(&raw);
        let gravity = raw.gravity.as_ref().map(|gravity| self.direction(gravity)).transpose();
        let (described, chain) = (described?, chain?);
        let typed_masses = self.masses(&raw, &chain);
        let base = self.base(&raw);
        let (masses, base, targets) = match &described {
            Some(arm) => {
                let masses = if raw.links.is_empty() { arm.masses.clone() } else { typed_masses };
                (masses, urdf_frames::on_root(base, arm), urdf_frames::at_tip(targets, arm))
            }
            None => (typed_masses, base, targets),
        };
        let mut model = Model {
            arm: raw.arm.clone(),
            masses,
            chain,
            base,
            targets,
            boards: Vec::new(),
            profile_sensor: None,
            free: Vec::new(),
            effects: Vec::new(),
            corrections: Vec::new(),
            priors: Vec::new(),
            measured_region: None,
            residual_map: None,
            pose_errors: Vec::new(),
            fitted: Vec::new(),
            surfaces,
            measured_from: measured_from(raw.measured_from),
            gravity: gravity.unwrap_or_default(),
            working_volume: working_volume.unwrap_or_default(),
            levels: Vec::new(),
            sensor: sensor.unwrap_or_default(),
            stripe_rig: None,
            noise,
            touch: None,
            definitions: Vec::new(),
            epochs: self.epochs_of(&raw),
            revision: raw.revision.as_ref().map(revision),
        };
        model.gravity = described.map_or(model.gravity, |arm| urdf_frames::gravity(&model, &arm));
        self.named_parts(&raw, &mut model, before);
        Ok(model)
    }

    /// What names parts of the model: effects only where no mistake was found, of which there were `before`.
    fn named_parts(&self, raw: &RawModel, model: &mut Model, before: usize) {
        self.measured(raw, model);
        model.levels = self.levels(raw, &model.chain);
        model.boards = self.boards(raw, model);
        model.profile_sensor =
            raw.profile.as_ref().and_then(|profile| self.profile_sensor(profile, model).ok());
        model.touch = raw.touch.as_ref().and_then(|touch| self.touch(touch, model).ok());
        if self.definitions(&raw.define, model) && self.problems.len() == before {
            self.all_effects(raw, model);
        }
    }

    fn all_effects(&self, raw: &RawModel, model: &mut Model) {
        for text in &raw.free {
            match effect::expand(&text.value, model) {
                Ok(_) => model.free.push(text.value.clone()),
                Err(error) => drop(self.fail::<()>(&text.span, error.to_string())),
            }
        }
        model.effects = self.listed_effects(&raw.effects, model);
        model.fitted = self.listed_effects(&raw.fitted, model);
        model.corrections = raw.effects.iter().flat_map(|raw| corrections(raw, model)).collect();
        model.priors = raw.effects.iter().flat_map(|raw| self.priors(raw, model)).collect();
        for valued in raw.fitted.iter().filter_map(valued) {
            if let Some((_, sd)) = valued.prior_sd.0.first() {
                let reason = "`prior_sd` belongs to effects that were added: those under `effects:`";
                drop(self.fail::<()>(&sd.span, reason.to_owned()));
            }
            if let Some(claim) = &valued.claim {
                let reason = "`claim` belongs to effects that were added: those under `effects:`";
                drop(self.fail::<()>(&claim.span, reason.to_owned()));
            }
        }
    }

    /// The effects of a list; those that are refused are among the problems.
    fn listed_effects(&self, raw: &[Spanned<RawEffect>], model: &Model) -> Vec<AddedEffect> {
        raw.iter().filter_map(|raw| self.effects(raw, model).ok()).flatten().collect()
    }

    fn chain(&self, raw: &RawModel) -> Checked<Chain> {
        let convention = match raw.convention.value {
            RawConvention::Proximal => Convention::Proximal,
            RawConvention::Distal | RawConvention::Urdf { .. } => Convention::Distal,
        };
        // A joint that is wrong is known by its name, so that what names it is not accused.
        let typed = raw.joints.iter().map(|joint| {
            self.joint(joint).unwrap_or_else(|_| Joint::turning(&joint.name.value, 0.0, 0.0, 0.0, 0.0))
        });
        let mut joints: Vec<Joint> = typed.collect();
        for (index, joint) in raw.joints.iter().enumerate() {
            if let Some(less) = &joint.less {
                let names = raw.joints.iter().take(index).map(|joint| joint.name.value.as_str());
                let Some(drive) = names.clone().position(|name| name == less.value) else {
                    let reason = format!(
                        "there is no joint `{}` before it{}",
                        less.value,
                        suggestion(&less.value, names)
                    );
                    return self.fail(&less.span, reason);
                };
                if let Some(joint) = joints.get_mut(index) {
                    joint.less = Some(drive);
                }
            }
            if raw.joints.iter().take(index).any(|other| other.name.value == joint.name.value) {
                return self.fail(&joint.name.span, format!("joint `{}` is named twice", joint.name.value));
            }
        }
        Chain::new(convention, joints).or_else(|error| self.fail(&raw.convention.span, error.to_string()))
    }

    pub(super) fn joint(&self, raw: &RawJoint) -> Checked<Joint> {
        let name = &raw.name;
        if name.value.trim().is_empty() || name.value.contains(['(', ')', ',', '*']) {
            return self.fail(&name.span, format!("`{}` cannot be a joint's name", name.value));
        }
        // What could not be read is NaN and reported where it is; 0 takes its place, so that the chain is not accused.
        let [a, alpha, d, theta] = [raw.a_mm, raw.alpha_deg, raw.d_mm, raw.theta_deg]
            .map(|number| if number.is_nan() { 0.0 } else { number });
        let mut joint = Joint::turning(&name.value, a, alpha.to_radians(), d, theta.to_radians());
        if raw.slides {
            joint.motion = Motion::Slides;
            joint.limits = (-1e6, 1e6);
        }
        let limits = match (raw.slides, &raw.limits_deg, &raw.limits_mm) {
            (false, Some(limits), None) => Some((limits, 1.0_f64.to_radians())),
            (true, None, Some(limits)) => Some((limits, 1.0)),
            (_, None, None) => None,
            (true, Some(limits), _) => {
                return self.fail(&limits.span, "a joint that slides has limits_mm");
            }
            (false, _, Some(limits)) => {
                return self.fail(&limits.span, "a joint that turns has limits_deg");
            }
        };
        if let Some((limits, scale)) = limits {
            let [low, high] = limits.value;
            if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
                return self.fail(
                    &limits.span,
                    format!("limits [{low}, {high}] hold no pose; the lower comes first"),
                );
            }
            joint.limits = (low * scale, high * scale);
        }
        if let Some(sign) = &raw.sign {
            // A fraction of a sign would be a gain.
            if sign.value.abs() != 1.0 {
                return self.fail(&sign.span, format!("a sign is 1 or -1, not {}", sign.value));
            }
            joint.sign = sign.value;
        }
        if let Some(ratio) = &raw.gear_ratio {
            if !ratio.value.is_finite() || ratio.value == 0.0 {
                return self.fail(&ratio.span, format!("a gear ratio of {} cannot be", ratio.value));
            }
            joint.gear_ratio = Some(ratio.value);
        }
        joint.screw_pitch = self.screw_pitch(raw)?;
        Ok(joint)
    }

    /// Travel for a turn of the screw, mm; nothing where none is given.
    fn screw_pitch(&self, raw: &RawJoint) -> Checked<Option<f64>> {
        let Some(pitch) = &raw.screw_pitch_mm else { return Ok(None) };
        if !raw.slides {
            let reason = format!("`{}` turns; screw_pitch_mm is of a joint that slides", raw.name.value);
            return self.fail(&pitch.span, reason);
        }
        if !(pitch.value.is_finite() && pitch.value > 0.0) {
            let reason = format!(
                "a pitch of {} mm cannot be; it is the travel for one turn of the screw, more than 0",
                pitch.value
            );
            return self.fail(&pitch.span, reason);
        }
        Ok(Some(pitch.value))
    }

    pub(super) fn joint_named(&self, name: &Spanned<String>, chain: &Chain) -> Checked<usize> {
        chain.position_of(&name.value).map_or_else(
            || {
                let names = chain.joints.iter().map(|joint| joint.name.as_str());
                self.fail(
                    &name.span,
                    format!("there is no joint `{}`{}", name.value, suggestion(&name.value, names)),
                )
            },
            Ok,
        )
    }

    fn masses(&self, raw: &RawModel, chain: &Chain) -> Vec<Mass> {
        raw.links.iter().filter_map(|link| self.mass(link, chain).ok()).collect()
    }

    /// The mass of one link. Both of its mistakes are reported, not the first alone.
    fn mass(&self, link: &RawLink, chain: &Chain) -> Checked<Mass> {
        let kg = link.mass_kg.value;
        let heavy = match kg < 0.0 {
            true => self.fail(&link.mass_kg.span, format!("a mass of {kg} kg cannot be; it is 0 or more")),
            false => Ok(kg),
        };
        let after = self.joint_named(&link.after, chain)?;
        Ok(Mass { after, mass: heavy?, centre: Vector3::from(link.centre_mm) })
    }

    /// One with a wrong name is there too, so that what names it is not accused.
    fn targets(&self, raw: &RawModel) -> Vec<Target> {
        let targets = raw.targets.0.iter().map(|(name, target)| {
            let number = name.value.strip_prefix('p').and_then(|digits| digits.parse::<u32>().ok());
            if number.is_none_or(|number| number == 0) {
                let message = format!("`{}` cannot be a target's name", name.value);
                let help = "a target is called p1, p2, ... as in the table's columns";
                self.problems.add(name.span, message, help);
            }
            Target {
                rotation: rotation(target.rpy_deg),
                rotation_free: target.free_rpy.unwrap_or(target.free),
                ..Target::point(&name.value, Vector3::from(target.xyz_mm), target.free)
            }
        });
        targets.collect()
    }

    fn direction(&self, typed: &Spanned<[f64; 3]>) -> Checked<Vector3<f64>> {
        let vector = Vector3::from(typed.value);
        // A stand-in: reported where it is.
        if vector.iter().any(|part| part.is_nan()) {
            return Err(Refused);
        }
        match vector.try_normalize(1e-12) {
            Some(unit) if unit.iter().all(|part| part.is_finite()) => Ok(unit),
            _ => self.fail(&typed.span, "this vector has no direction; write for example [0, 0, 1]"),
        }
    }

    fn working_volume(&self, typed: &Spanned<RawVolume>) -> Checked<[(f64, f64); 3]> {
        let RawVolume { x_mm, y_mm, z_mm } = typed.value;
        let spans = [x_mm, y_mm, z_mm].map(|[low, high]| (low, high));
        match spans.iter().all(|(low, high)| low.is_finite() && high.is_finite() && low < high) {
            true => Ok(spans),
            false => self.fail(
                &typed.span,
                "each of x_mm, y_mm and z_mm needs a least and a greater number, such as [100, 300]",
            ),
        }
    }

    /// One of no shape is a point, so that what names it is not accused.
    fn surfaces(&self, raw: &RawModel) -> Vec<Surface> {
        let surfaces = raw.surfaces.0.iter().map(|(name, raw)| {
            let light = raw.line.as_ref().and_then(|line| line.light);
            let light = light.map(|side| if side == RawSide::Left { 1.0 } else { -1.0 });
            let unknown = SurfaceShape::Point { point: Vector3::zeros() };
            let shape = self.surface_shape(&name.span, raw).unwrap_or(unknown);
            Surface { name: name.value.clone(), shape, free: raw.free, light }
        });
        surfaces.collect()
    }

    fn surface_shape(&self, name: &Span, raw: &RawSurface) -> Checked<SurfaceShape> {
        match (&raw.plane, &raw.line, &raw.sphere, &raw.point_mm) {
            (Some(plane), None, None, None) => {
                Ok(SurfaceShape::Plane { normal: self.direction(&plane.normal)?, offset: plane.offset_mm })
            }
            (None, Some(line), None, None) => Ok(SurfaceShape::Line {
                point: Vector3::from(line.point_mm),
                direction: self.direction(&line.direction)?,
            }),
            (None, None, Some(sphere), None) => {
                let (centre, radius) = (Vector3::from(sphere.centre_mm), sphere.radius_mm.value);
                match radius > 0.0 && radius.is_finite() {
                    true => Ok(SurfaceShape::Sphere { centre, radius, free_radius: false }),
                    false => {
                        self.fail(&sphere.radius_mm.span, format!("a ball of radius {radius} mm cannot be"))
                    }
                }
            }
            (None, None, None, Some(point)) => Ok(SurfaceShape::Point { point: Vector3::from(*point) }),
            _ => self.fail(name, "a surface is one of `plane`, `line`, `sphere`, `point_mm`"),
        }
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
            Some(reason) => self.fail(&raw.span, reason),
            None => Ok(sensor),
        }
    }

    /// The one under `level:`, which has no name, and those under `levels:`, which do.
    fn levels(&self, raw: &RawModel, chain: &Chain) -> Vec<Level> {
        let named = raw.levels.0.iter().map(|(name, level)| (Some(name.value.clone()), level));
        let all = raw.level.iter().map(|level| (None, level)).chain(named);
        all.filter_map(|(name, level)| self.level(name, level, chain).ok()).collect()
    }

    fn level(&self, name: Option<String>, raw: &RawLevel, chain: &Chain) -> Checked<Level> {
        let frame = match &raw.after {
            None => Frame::After(chain.len().saturating_sub(1)),
            Some(name) if name.value == "base" => Frame::Base,
            // The flange is after the last joint, unless a joint is called so.
            Some(name) if name.value == "flange" && chain.position_of("flange").is_none() => {
                Frame::After(chain.len().saturating_sub(1))
            }
            Some(name) => Frame::After(self.joint_named(name, chain)?),
        };
        Ok(Level { name, frame, rotation: rotation(raw.rpy_deg) })
    }

    fn touch(&self, raw: &RawTouch, model: &Model) -> Checked<Touch> {
        let target = match &raw.p {
            None => "p1".to_owned(),
            Some(name) if model.target_position(&name.value).is_some() => name.value.clone(),
            Some(name) => {
                let names = model.targets.iter().map(|target| target.name.as_str());
                let reason = format!("there is no target `{}`{}", name.value, suggestion(&name.value, names));
                return self.fail(&name.span, reason);
            }
        };
        let mut distances = Vec::new();
        for distance in &raw.distances {
            if distance.mm.value < 0.0 {
                return self
                    .fail(&distance.mm.span, format!("a distance of {} mm cannot be", distance.mm.value));
            }
            distances
                .push(TouchDistance { between: distance.between.value.clone(), length: distance.mm.value });
        }
        if let Some((entry, reason)) = contradiction(&distances)
            && let Some(raw) = raw.distances.get(entry)
        {
            return self.fail(&raw.between.span, reason);
        }
        Ok(Touch { target, distances })
    }

    fn effects(&self, raw: &Spanned<RawEffect>, model: &Model) -> Checked<Vec<AddedEffect>> {
        let at_zero = |id: EffectId, location: &Span| match effect::build(&id, model) {
            Ok(built) => Ok(AddedEffect { id, values: vec![0.0; built.parameters().len()] }),
            Err(error) => self.fail(location, error.to_string()),
        };
        let location = &raw.span;
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
            .or_else(|error| self.fail(&raw.effect.span, error.to_string()))?;
        for (name, value) in &raw.values.0 {
            let index = self.value_named(name, &added.id, built.as_ref())?;
            if !value.value.is_finite() {
                return self.fail(&value.span, format!("`{}` is not finite", name.value));
            }
            let factor = built.parameters().get(index).map_or(1.0, |parameter| parameter.unit.factor);
            if let Some(slot) = added.values.get_mut(index) {
                *slot = value.value / factor;
            }
        }
        Ok(added)
    }

    /// Which of an effect's values this is.
    fn value_named(&self, name: &Spanned<String>, id: &EffectId, built: &dyn Effect) -> Checked<usize> {
        let found = built.parameters().iter().position(|parameter| parameter.name == name.value);
        match found {
            Some(index) => Ok(index),
            None => {
                let names = built.parameters().iter().map(|parameter| parameter.name.as_str());
                let similar = suggestion(&name.value, names);
                self.fail(&name.span, format!("`{}` has no value `{}`{similar}", id.name, name.value))
            }
        }
    }

    /// What an effect says of its values beforehand; nothing of an effect that was refused already.
    fn priors(&self, raw: &Spanned<RawEffect>, model: &Model) -> Vec<ValuePrior> {
        let Some(valued) = valued(raw).filter(|valued| !valued.prior_sd.0.is_empty()) else {
            return Vec::new();
        };
        let ids = effect::expand(&written(valued), model).unwrap_or_default();
        // An effect that cannot be built was refused with its values.
        let built = ids.into_iter().filter_map(|id| Some((effect::build(&id, model).ok()?, id)));
        built.filter_map(|(built, id)| self.prior(id, built.as_ref(), valued).ok()).collect()
    }

    fn prior(&self, id: EffectId, built: &dyn Effect, raw: &RawValuedEffect) -> Checked<ValuePrior> {
        let mut sd = vec![None; built.parameters().len()];
        for (name, value) in &raw.prior_sd.0 {
            let index = self.value_named(name, &id, built)?;
            if !(value.value.is_finite() && value.value > 0.0) {
                let reason = format!("the standard deviation of `{}` must be greater than zero", name.value);
                return self.fail(&value.span, reason);
            }
            let factor = built.parameters().get(index).map_or(1.0, |parameter| parameter.unit.factor);
            if let Some(slot) = sd.get_mut(index) {
                *slot = Some(value.value / factor);
            }
        }
        Ok(ValuePrior { id, sd })
    }
}

/// Roll, pitch and yaw: Rz(yaw) Ry(pitch) Rx(roll).
pub(super) fn rotation(rpy_deg: [f64; 3]) -> Rotation3<f64> {
    let [roll, pitch, yaw] = rpy_deg.map(f64::to_radians);
    Rotation3::from_euler_angles(roll, pitch, yaw)
}

/// An effect that was written with its values.
fn valued(raw: &Spanned<RawEffect>) -> Option<&RawValuedEffect> {
    match &raw.value {
        RawEffect::Valued(valued) => Some(valued),
        RawEffect::Named(_) => None,
    }
}

/// What an effect that is a correction says of itself; nothing of a mechanism, nor of an effect that was refused already.
fn corrections(raw: &Spanned<RawEffect>, model: &Model) -> Vec<Correction> {
    let Some(valued) = valued(raw) else { return Vec::new() };
    if valued.claim.as_ref().map(|claim| claim.value) != Some(RawClaim::Correction) {
        return Vec::new();
    }
    let ids = effect::expand(&written(valued), model).unwrap_or_default();
    ids.into_iter().map(|id| Correction { id, may_be: valued.may_be.clone() }).collect()
}

/// An effect's keys as one text, as it would be written by itself.
fn written(raw: &RawValuedEffect) -> String {
    let mut arguments = Vec::new();
    arguments.extend(raw.place.as_ref().map(|site| site.value.clone()));
    arguments.extend(raw.with.as_ref().map(|with| with.value.clone()));
    arguments.extend(raw.n.map(|order| order.to_string()));
    arguments.extend(raw.of.as_ref().map(|of| of.value.clone()));
    match arguments.is_empty() {
        true => raw.effect.value.clone(),
        false => format!("{}({})", raw.effect.value, arguments.join(", ")),
    }
}
