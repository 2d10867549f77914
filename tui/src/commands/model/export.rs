//! `plumb model export`: the calibrated model in the forms of other programs.

use std::error::Error;

use plumb_calibration::arm_model::Model;
use plumb_calibration::export::{
    CompensatedTarget, Compensation, RigidArm, axis_scale, compensated_targets, compensation, dh_table,
    fluidnc, linuxcnc, ros_calibration, urdf,
};
use plumb_calibration::forward::ForwardModel;
use plumb_calibration::revision::{Entry, Family};
use plumb_calibration::table::Table;
use plumb_kinematics::Motion;

use super::arguments::{ExportArguments, ExportForm, FLUIDNC_AXES};

/// What a form cannot hold.
#[derive(Debug, thiserror::Error)]
#[error(
    "rigid links between joints cannot hold {}: without them the flange would be up to {off_mm:.3} mm and {off_deg:.4} deg elsewhere, over {POSES} poses \
     within the limits; --leave-out writes the rest",
    effects.join(", ")
)]
struct CannotHold {
    effects: Vec<String>,
    off_mm: f64,
    off_deg: f64,
}

/// Poses at which the size of what is left out is looked at.
const POSES: u32 = 1000;

/// The model as another program reads it.
///
/// # Errors
/// The file cannot be read, or holds what the form cannot and that is not to be left out.
pub(super) fn run(arguments: &ExportArguments) -> Result<String, Box<dyn Error>> {
    let entry = Family::resolve(&arguments.model)?;
    if let (ExportForm::Targets, Some(poses)) = (arguments.form, &arguments.poses) {
        return targets(&entry, &Family::of(&arguments.model)?, &Table::read(poses)?);
    }
    let model = entry.model;
    match arguments.form {
        ExportForm::Linuxcnc => return compensation_file(&model, arguments),
        ExportForm::Fluidnc => return scale_of_an_axis(&model, arguments),
        _ => {}
    }
    let arm = RigidArm::of(&model)?;
    for effect in &arm.not_the_robot {
        eprintln!("left aside: {effect} is no part of the robot");
    }
    if !arm.left_out.is_empty() {
        let (off_mm, off_deg) = greatest_difference(&arm, &model)?;
        let cannot = CannotHold { effects: arm.left_out.clone(), off_mm, off_deg };
        if !arguments.leave_out {
            return Err(cannot.into());
        }
        eprintln!("left out: {} (up to {off_mm:.3} mm and {off_deg:.4} deg)", cannot.effects.join(", "));
    }
    Ok(match arguments.form {
        ExportForm::Urdf => urdf(&arm),
        ExportForm::RosCalibration => {
            let written = ros_calibration(&arm)?;
            behind_last_joint(&arm, arguments)?;
            written
        }
        ExportForm::Dh => dh_table(&arm, &model),
        ExportForm::Targets => return Err("give the program's targets with --poses".into()),
        ExportForm::Linuxcnc => compensation_file(&model, arguments)?,
        ExportForm::Fluidnc => scale_of_an_axis(&model, arguments)?,
    })
}

/// A UR driver's calibration ends with the frame of the last joint: what lies behind it is refused, or reported where it is to be left out.
fn behind_last_joint(arm: &RigidArm, arguments: &ExportArguments) -> Result<(), Box<dyn Error>> {
    let Some((off_mm, off_deg)) = arm.behind_last_joint() else { return Ok(()) };
    let what = format!(
        "the flange behind the last joint ({off_mm:.3} mm, {off_deg:.3} deg): such a file ends with the last joint; add it to the tool (TCP) of the robot"
    );
    if !arguments.leave_out {
        return Err(format!(
            "a UR driver's calibration cannot hold {what}. --leave-out writes the rest, a URDF holds it"
        )
        .into());
    }
    eprintln!("left out: {what}");
    Ok(())
}

/// Targets for the calibrated arm, and where the tip is to come with each: a table that procedures repeat over.
fn targets(calibrated: &Entry, family: &Family, poses: &Table) -> Result<String, Box<dyn Error>> {
    let drawing = family.entry(0)?;
    let found = compensated_targets(&drawing.model, &calibrated.model, poses)?;
    let off = found.iter().map(|target| target.off_before).fold(0.0, f64::max);
    eprintln!(
        "{} targets by {}, in place of those by {}: at the old ones the tip would come up to {off:.3} mm off",
        found.len(),
        calibrated.path.display(),
        drawing.path.display()
    );
    Ok(as_table(&found, &calibrated.model))
}

fn as_table(found: &[CompensatedTarget], model: &Model) -> String {
    let slides =
        |joint: usize| model.chain.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Slides);
    let heads = (0..model.chain.len()).map(|joint| {
        let unit = if slides(joint) { "mm" } else { "deg" };
        format!("q{}_{unit}", joint + 1)
    });
    let mut text =
        heads.chain(["x_mm", "y_mm", "z_mm"].map(str::to_owned)).collect::<Vec<_>>().join(",") + "\n";
    for target in found {
        let joints = target.q.iter().enumerate();
        let joints =
            joints.map(
                |(joint, q)| if slides(joint) { format!("{q:.5}") } else { format!("{:.5}", q.to_degrees()) },
            );
        let coordinates = target.requested.iter().map(|value| format!("{value:.4}"));
        text += &(joints.chain(coordinates).collect::<Vec<_>>().join(",") + "\n");
    }
    text
}

/// One joint's errors over its travel, and the joint.
fn errors_of_a_joint(
    model: &Model,
    arguments: &ExportArguments,
    what: &str,
) -> Result<(usize, Compensation), Box<dyn Error>> {
    let joints = &model.chain.joints;
    let joint = match (&arguments.joint, joints.as_slice()) {
        (Some(name), _) => model.chain.position_of(name),
        (None, [_]) => Some(0),
        (None, _) => None,
    };
    let joint = joint.ok_or_else(|| {
        let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
        let problem =
            arguments.joint.as_ref().map_or_else(String::new, |name| format!("there is no joint `{name}`: "));
        format!("{problem}{what} is of one joint; say which, as in --joint {}", names.join(" or --joint "))
    })?;
    let table = compensation(model, joint, usize::from(arguments.lines))?;
    if !table.left_out.is_empty() {
        let left_out = table.left_out.join(", ");
        if !arguments.leave_out {
            return Err(format!(
                "{what} holds what goes by the joint's own position and direction, and cannot hold {left_out}; --leave-out writes the rest"
            )
            .into());
        }
        eprintln!("left out: {left_out}");
    }
    Ok((joint, table))
}

/// One joint's errors for LinuxCNC; how to use the file goes to standard error.
fn compensation_file(model: &Model, arguments: &ExportArguments) -> Result<String, Box<dyn Error>> {
    let (_, table) = errors_of_a_joint(model, arguments, "a compensation file")?;
    eprintln!(
        "for the joint's section of the INI file: COMP_FILE = NAME, COMP_FILE_TYPE = 0, no BACKLASH beside it. Lengths are in mm, as of a machine with LINEAR_UNITS = mm. \
         Between its lines the file is off by up to {:.6} {}",
        table.between, table.unit
    );
    Ok(linuxcnc(&table))
}

/// What a scale may miss without a word, mm or degrees: rounding in the model.
const NO_MISS: f64 = 1e-6;

/// A joint's scale for FluidNC; what it leaves, and the zero, go to standard error.
fn scale_of_an_axis(model: &Model, arguments: &ExportArguments) -> Result<String, Box<dyn Error>> {
    let steps_per_mm = arguments.steps_per_mm.ok_or("give the axis's steps_per_mm with --steps-per-mm")?;
    let (joint, table) = errors_of_a_joint(model, arguments, "a scale")?;
    let name = model.chain.joints.get(joint).map_or("", |joint| joint.name.as_str());
    let axis = arguments.axis.as_deref().unwrap_or(name);
    if !FLUIDNC_AXES.contains(&axis) {
        let known = FLUIDNC_AXES.join(", ");
        return Err(format!("FluidNC's axes are {known}; say which `{name}` is, as in --axis x").into());
    }
    let (scale, unit) = (axis_scale(&table), table.unit);
    if scale.off > NO_MISS {
        let what = format!(
            "FluidNC holds a scale for each axis, no table and no play: with it the joint is still up to {:.6} {unit} off",
            scale.off
        );
        if !arguments.leave_out {
            return Err(format!(
                "{what}. --leave-out writes the scale; a program's targets are corrected whole by --as targets"
            )
            .into());
        }
        eprintln!("left out: {what}");
    }
    // Rounded here, so that nothing is shown as less than nothing.
    let zero = (scale.zero * 1e6).round() / 1e6 + 0.0;
    eprintln!(
        "the axis's `mpos_mm` under `homing`, P as it is now, becomes {zero:.6} + {:.9} P; find work offsets anew",
        scale.slope
    );
    Ok(fluidnc(axis, &scale, steps_per_mm))
}

/// By how much the flange differs at most, mm and degrees, where the whole model and its rigid part are in the same pose.
fn greatest_difference(arm: &RigidArm, model: &Model) -> Result<(f64, f64), Box<dyn Error>> {
    let forward = ForwardModel::new(model.clone())?;
    let (mut off_mm, mut off_deg) = (0.0_f64, 0.0_f64);
    for pose in 1..=POSES {
        let q: Vec<f64> = arm
            .joints
            .iter()
            .zip(PRIMES.iter().cycle())
            .map(|(joint, prime)| {
                joint.limits.0 + radical_inverse(pose, *prime) * (joint.limits.1 - joint.limits.0)
            })
            .collect();
        let (rigid, whole) = (arm.flange(&q), forward.flange(&q, &[]));
        off_mm = off_mm.max((rigid.translation.vector - whole.translation.vector).norm());
        off_deg = off_deg.max(rigid.rotation.angle_to(&whole.rotation).to_degrees());
    }
    Ok((off_mm, off_deg))
}

/// Bases of the Halton sequence, one a joint (Halton 1960): poses spread evenly, the same each time.
const PRIMES: [u32; 8] = [2, 3, 5, 7, 11, 13, 17, 19];

/// A whole number's digits in some base, mirrored at the point: between 0 and 1.
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0 / f64::from(base));
    while number > 0 {
        value += f64::from(number % base) * digit;
        number /= base;
        digit /= f64::from(base);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::radical_inverse;

    #[test]
    fn digits_are_mirrored() {
        assert_eq!([1, 2, 3, 4].map(|number| radical_inverse(number, 2)), [0.5, 0.25, 0.75, 0.125]);
    }
}
