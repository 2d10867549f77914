//! Whole files to begin with: those that are shipped, those of `corpus/`, and what the program itself writes.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::Point3;
use plumb_cloud::{Cloud, CloudPoint};
use plumb_plugin::{DeviceState, FrameHeader, Reply, Request, StripeHeader, StripePoint};
use tempfile::TempDir;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A file of `workcells/`.
pub(crate) fn shipped(name: &str) -> Vec<u8> {
    fs::read(root().join("workcells").join(name)).unwrap()
}

/// The files of a folder of `workcells/` with that ending.
pub(crate) fn shipped_under(folder: &str, ending: &str) -> Vec<Vec<u8>> {
    files_of(&root().join("workcells").join(folder), ending)
}

/// The files that are kept for a target, among them those that once were trouble.
pub(crate) fn of_folder(target: &str) -> Vec<Vec<u8>> {
    files_of(&root().join("tests/fuzz/corpus").join(target), "")
}

fn files_of(folder: &Path, ending: &str) -> Vec<Vec<u8>> {
    let entries = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> =
        entries.filter(|path| path.is_file() && path.to_string_lossy().ends_with(ending)).collect();
    files.sort();
    files.iter().map(|path| fs::read(path).unwrap()).collect()
}

/// A folder in which changed files are written, one over the other.
pub(crate) struct Beside {
    folder: TempDir,
    inside: PathBuf,
}

impl Beside {
    /// An empty one.
    pub(crate) fn nothing() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().to_owned();
        Self { folder, inside }
    }

    /// A copy of a cell's.
    pub(crate) fn cell(name: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        copy(&root().join("workcells").join(name), &folder.path().join(name));
        copy(&root().join("workcells/arms"), &folder.path().join("arms"));
        let inside = folder.path().join(name);
        Self { folder, inside }
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.inside.join(name);
        fs::write(&path, bytes).unwrap();
        path
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            fs::copy(&path, &target).unwrap();
        }
    }
}

pub(crate) fn models() -> Vec<Vec<u8>> {
    let mut models = files_of(&root().join("core/model/robots"), "yaml");
    models.extend(shipped_under("teachmover", "model.yaml"));
    models
}

pub(crate) fn table() -> Vec<u8> {
    let mut table =
        "q1_deg,q2_deg,approach_q1,payload_kg,time_s,repeat,on,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for row in 0..20 {
        let q = f64::from(row) * 7.5 - 60.0;
        let side = if row % 2 == 0 { 1 } else { -1 };
        table += &format!("{q},{},{side},0.5,{row},r{},table,{},{q},1e-3\n", -q, row / 4, 700.0 + q);
    }
    table.into_bytes()
}

pub(crate) fn worlds() -> Vec<Vec<u8>> {
    let folder = |cell: &str| root().join("workcells").join(cell);
    let all = ["teachmover", "puma", "light-stripe"].map(|cell| fs::read_dir(folder(cell)).unwrap());
    let paths = all.into_iter().flatten().map(|entry| entry.unwrap().path());
    let is_world = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().starts_with("world");
    let mut paths: Vec<PathBuf> = paths.filter(is_world).collect();
    paths.sort();
    let mut worlds: Vec<Vec<u8>> = paths.iter().map(|path| fs::read(path).unwrap()).collect();
    let sealed = plumb_simulated::world::file::seal(&String::from_utf8_lossy(&worlds[0]));
    worlds.push(sealed.into_bytes());
    worlds
}

pub(crate) fn arm_descriptions() -> Vec<Vec<u8>> {
    shipped_under("arms", "yaml")
}

pub(crate) fn cameras() -> Vec<Vec<u8>> {
    use plumb_light_stripe::geometry::{CameraFormat, read_rig, write_camera};
    let camera = read_rig(&root().join("workcells/light-stripe/rig.yaml")).unwrap().camera;
    [CameraFormat::Ros, CameraFormat::OpenCv]
        .map(|format| write_camera(&camera, "camera", format).into_bytes())
        .into()
}

pub(crate) fn manifests() -> Vec<Vec<u8>> {
    let entries = fs::read_dir(root().join("plugins")).unwrap().map(|entry| entry.unwrap().path());
    entries.filter_map(|path| fs::read(path.join("plugin.yaml")).ok()).collect()
}

pub(crate) fn pgm() -> Vec<Vec<u8>> {
    let pixels: Vec<u8> = (0..=255).collect();
    let levels: Vec<String> = pixels.iter().map(u8::to_string).collect();
    vec![
        plumb_light_stripe::frame::write_pgm(16, 16, &pixels),
        format!("P2 # plain\n16 16 255\n{}\n", levels.join(" ")).into_bytes(),
        [b"P5 8 16 65535\n".to_vec(), pixels].concat(),
    ]
}

pub(crate) fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 16, 16);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(&(0..=255).collect::<Vec<u8>>()).unwrap();
    bytes
}

pub(crate) fn cloud(ending: &str) -> Vec<u8> {
    let point = |number: u32| CloudPoint {
        position: Point3::new(f64::from(number), 2.0, -3.5),
        stripe: number / 4,
        seen: StripePoint::default(),
    };
    let cloud = Cloud { points: (0..12).map(point).collect(), ..Cloud::default() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("a.{ending}"));
    plumb_cloud::write(&cloud, &path, 0, None).unwrap();
    fs::read(path).unwrap()
}

pub(crate) fn scan() -> Vec<u8> {
    let joints: Vec<String> = ["waist", "shoulder"].map(str::to_owned).into();
    let folder = tempfile::tempdir().unwrap();
    Cloud::default().save(folder.path(), "a", &joints, "plate").unwrap();
    let text = |ending: &str| fs::read_to_string(folder.path().join(ending)).unwrap();
    format!("{}====\n{}", text("a.poses.csv"), text("a.stripes.csv")).into_bytes()
}

pub(crate) fn sealed_answer() -> Vec<u8> {
    fs::read(root().join("tests/fuzz/corpus/answer.sealed")).unwrap()
}

/// Lines as a controller sends them, each by itself, and all of them.
pub(crate) fn lines_of(lines: &[&str]) -> Vec<Vec<u8>> {
    let mut all: Vec<Vec<u8>> = lines.iter().map(|line| format!("{line}\r\n").into_bytes()).collect();
    all.push(format!("{}\r\n.", lines.join("\r\n")).into_bytes());
    all
}

/// What a controller of Universal Robots answers, and a state.
pub(crate) fn rtde_packages() -> Vec<Vec<u8>> {
    use plumb_universal_robots::rtde::{Kind, STATE_BYTES, package};
    let mut state = vec![0; STATE_BYTES];
    state[0] = 1;
    vec![
        package(Kind::RequestVersion, &[1]),
        package(Kind::ControllerVersion, &[0, 0, 0, 5, 0, 0, 0, 19, 0, 0, 0, 0, 0, 0, 0, 1]),
        package(Kind::SetUpOutputs, b"\x01DOUBLE,VECTOR6D"),
        package(Kind::Text, b"\x02hi\x02me\x03"),
        package(Kind::Data, &state),
    ]
}

/// What its primary interface reports: an error in line 3 of a program, and a state.
pub(crate) fn primary_messages() -> Vec<Vec<u8>> {
    let error = b"\x00\x00\x00\x1c\x14\0\0\0\0\0\0\0\x09\xfd\x0a\0\0\0\x03\0\0\0\x01wrong";
    vec![error.to_vec(), b"\x00\x00\x00\x06\x10\x01".to_vec()]
}

pub(crate) fn world_lines() -> Vec<Vec<u8>> {
    let lines = [
        r#"{"protocol":1,"client":"plumb"}"#,
        r#"{"id":1,"do":"joints"}"#,
        r#"{"id":2,"do":{"move":{"to":[0.1,null,null,null,null,null],"speed":0.5}}}"#,
        r#"{"id":2,"say":{"error":"no"}}"#,
        r#"{"id":2,"say":"done"}"#,
    ];
    lines.map(|line| line.as_bytes().to_vec()).into()
}

pub(crate) fn requests() -> Vec<Vec<u8>> {
    let whole = |(code, body): (u32, Vec<u8>)| [vec![code as u8], body].concat();
    let reply = |reply: Reply| {
        let (code, _, body) = Reply::encode(&Ok(reply));
        whole((code, body))
    };
    vec![
        whole(Request::Describe.encode()),
        whole(Request::ReadJoints.encode()),
        reply(Reply::Done),
        reply(Reply::State(DeviceState::Active)),
    ]
}

pub(crate) fn messages() -> Vec<Vec<u8>> {
    let header = FrameHeader { width: 4, height: 4, ..FrameHeader::default() };
    let mut frame = vec![0; header.message_bytes()];
    let _pixels = header.write(&mut frame).unwrap();
    let stripe = StripeHeader::default().message(&[StripePoint::default(); 3]);
    vec![frame, stripe]
}

pub(crate) fn events() -> Vec<Vec<u8>> {
    let recorded = fs::read(root().join("tests/screens/recorded-run.jsonl")).unwrap();
    recorded
        .split(|byte| *byte == b'\n')
        .take(200)
        .filter(|line| !line.is_empty())
        .map(<[u8]>::to_vec)
        .collect()
}

/// A record with its tables, and its write-ahead log taken in.
pub(crate) fn record() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let record = plumb_record::Record::open(folder.path()).unwrap();
    record.back_up(&folder.path().join("copy")).unwrap();
    fs::read(folder.path().join("copy")).unwrap()
}
