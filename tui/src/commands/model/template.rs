//! `plumb model template`.

use std::error::Error;
use std::io::Write as _;

use plumb_calibration::template::Template;

use super::arguments::TemplateArguments;

/// Writes an empty pair; never over a file that is there.
pub(super) fn run(arguments: &TemplateArguments) -> Result<String, Box<dyn Error>> {
    let file = std::path::Path::new(&arguments.robot);
    let is_urdf = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("urdf"));
    let template = match (is_urdf, &arguments.tip) {
        (true, tip) => Template::of_urdf(file, tip.as_deref())?,
        (false, None) => Template::of(&arguments.robot)?,
        (false, Some(_)) => {
            return Err("--tip says where the arm of a URDF file ends; give a file that ends in .urdf".into());
        }
    };
    std::fs::create_dir_all(&arguments.output)
        .map_err(|error| super::not_written(&arguments.output, &error))?;
    let model = arguments.output.join(format!("{}.yaml", template.name));
    let table = arguments.output.join(format!("{}.csv", template.name));
    for (path, text) in [(&model, &template.model), (&table, &template.table)] {
        std::fs::File::create_new(path)
            .and_then(|mut file| file.write_all(text.as_bytes()))
            .map_err(|error| super::not_written(path, &error))?;
    }
    let ends = template.ends.map_or_else(String::new, |(root, tip)| {
        format!("The arm is what moves between `{root}` and `{tip}`; --tip LINK takes another end.\n")
    });
    Ok(format!(
        "Wrote {} and {}.\n{ends}Check the model's lengths, put one row a pose into the table (leave empty what was not measured or logged), \
         return to five poses or more under the same `repeat` id, then: plumb model compare {} --data {}\n",
        model.display(),
        table.display(),
        model.display(),
        table.display()
    ))
}
