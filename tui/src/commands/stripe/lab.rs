//! A cell with a light stripe as the lab sees it: the arm's model, the rig, what is there, and scans of it.

use std::path::{Path, PathBuf};

use plumb_calibration::arm_model::{Model, StripeRig};
use plumb_calibration::effect::{self, EffectId};
use plumb_cell::expression::Calculator;
use plumb_cell::workcell::{DeviceSetting, Workcell, load_workcell};
use plumb_diagnosis::stripe::{AdjustError, Adjustment, Scans, StripeScene, Surface, adjust, read_scene};
use plumb_estimation::Progress;
use plumb_light_stripe::geometry::{Distortion, Rig, StripePlane, read_rig};

use super::lab_error::LabError;
use super::rig_in_force::{in_force, rig_with};

/// Which cell and which scans.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Chosen {
    /// The cell file.
    pub(crate) cell: PathBuf,
    /// The folder of a run with scans that were saved.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) scans: PathBuf,
    /// The file of what is there; `scene.yaml` beside the cell if left out.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// What has been named before and is adjusted too: `joint_compliance(shoulder)`, `lens_distortion`. May be given several times.
    #[arg(long, value_name = "EFFECT")]
    pub(crate) add: Vec<String>,
}

/// Everything opened.
pub(crate) struct Lab {
    /// The arm without effects.
    pub(crate) model: Model,
    /// The rig as the cell has it.
    pub(crate) rig: Rig,
    /// How much later than its time says a picture was taken, as the cell has it, ms.
    pub(crate) exposure_delay_ms: f64,
    /// Forms, about where they are.
    pub(crate) surfaces: Vec<(String, Surface)>,
    /// What was seen.
    pub(crate) scans: Scans,
    /// What is adjusted beside zeros and rig.
    pub(crate) added: Vec<EffectId>,
}

impl Lab {
    /// The adjustment of zeros, rig and what is added to the scans.
    ///
    /// # Errors
    /// [`AdjustError`]
    pub(crate) fn adjusted(&self, progress: &Progress) -> Result<Adjustment, AdjustError> {
        let rig = to_lab(&self.rig);
        let scene =
            StripeScene { model: &self.model, rig: &rig, surfaces: &self.surfaces, scans: &self.scans };
        adjust(scene, &self.added, progress)
    }
}

/// The key of the sensor's configuration for how much later than its time says a picture was taken.
pub(super) const DELAY: &str = "exposure_delay_ms";

/// Of a picture's rows so many are looked at: neighbours report almost the same.
const ROWS_A_PICTURE: u32 = 21;

impl Chosen {
    /// Opens it.
    ///
    /// # Errors
    /// [`LabError`]
    pub(crate) fn open(&self) -> Result<Lab, LabError> {
        let cell = load_workcell(&self.cell, &Calculator::new()).map_err(|problems| {
            LabError::Cell(problems.iter().map(ToString::to_string).collect::<String>())
        })?;
        let lacks = |what| LabError::NoStripe { cell: self.cell.clone(), what };
        let (sensor, rig) = rig_of(&cell, &self.cell)?;
        let carrier = sensor.inputs.iter().find(|wire| wire.input == "pose").map(|wire| wire.device.as_str());
        let robot = carrier.and_then(|carrier| cell.robot(carrier));
        let robot =
            robot.ok_or_else(|| lacks("the light stripe's `pose` comes from no robot of `robots:`"))?;
        let file = robot.model.as_ref().ok_or_else(|| lacks("the robot has no `model:`"))?;
        let mut model = Model::parse(&file.file.display().to_string(), &file.text)?;
        let before = model.effects.iter().filter(|effect| effect.id.name != "joint_zero");
        let mut added: Vec<EffectId> = before.map(|effect| effect.id.clone()).collect();
        for name in &self.add {
            let one = effect::parse(name, &model)?;
            if !added.iter().any(|known| known.same_as(&one)) {
                added.push(one);
            }
        }
        model.effects.clear();
        model.fitted.clear();
        let beside = self.cell.parent().unwrap_or(Path::new(""));
        let scene = self.scene.clone().unwrap_or_else(|| beside.join("scene.yaml"));
        // A run's folder lies in its record.
        let record = self.scans.parent().unwrap_or(Path::new(""));
        let corrections = in_force(record, &cell, &sensor)?;
        let rig = rig_with(&read_rig(&beside.join(rig))?, &corrections)?;
        let every_row = rig.camera.height_px / ROWS_A_PICTURE;
        let surfaces = read_scene(&scene)?;
        let scans = Scans::read(&self.scans)?.thinned(every_row);
        Ok(Lab {
            model,
            rig,
            exposure_delay_ms: sensor.config.get(DELAY).and_then(serde_json::Value::as_f64).unwrap_or(0.0),
            surfaces,
            scans,
            added,
        })
    }
}

/// The light stripe of a cell, and the name of its rig file.
///
/// # Errors
/// [`LabError::NoStripe`]
pub(crate) fn rig_of(cell: &Workcell, path: &Path) -> Result<(DeviceSetting, String), LabError> {
    let with_rig = |device: &DeviceSetting| {
        let rig = device.config.get("rig")?.as_str()?.to_owned();
        (device.plugin == "light-stripe").then_some((device.clone(), rig))
    };
    let what = "no device is a light-stripe with a `rig:`";
    let found = cell.devices.iter().find_map(with_rig);
    found.ok_or_else(|| LabError::NoStripe { cell: path.to_owned(), what })
}

/// The rig as the lab has it.
pub(crate) fn to_lab(rig: &Rig) -> StripeRig {
    let camera = &rig.camera;
    let Distortion { k1, k2, p1, p2, k3 } = camera.distortion;
    StripeRig {
        focal_px: [camera.fx_px, camera.fy_px],
        principal_px: [camera.cx_px, camera.cy_px],
        distortion: [k1, k2, p1, p2, k3],
        flange_from_camera: rig.flange_from_camera,
        normal: rig.plane.normal,
        d_mm: rig.plane.d_mm,
        bow: rig.bow_per_mm,
    }
}

/// The rig as its file has it, from what the lab found.
pub(crate) fn from_lab(found: &StripeRig, before: &Rig) -> Rig {
    let mut rig = before.clone();
    let [k1, k2, p1, p2, k3] = found.distortion;
    rig.camera.distortion = Distortion { k1, k2, p1, p2, k3 };
    [rig.camera.fx_px, rig.camera.fy_px] = found.focal_px;
    [rig.camera.cx_px, rig.camera.cy_px] = found.principal_px;
    rig.flange_from_camera = found.flange_from_camera;
    rig.bow_per_mm = found.bow;
    rig.plane = StripePlane { normal: found.normal, d_mm: found.d_mm };
    rig
}
