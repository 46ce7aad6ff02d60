//! Directives with their arguments and parameters.

use std::path::Path;
use std::sync::Arc;

use super::lexer::{Lexer, Token, shown};
use crate::error::SceneError;
use crate::import::translation::Place;
use crate::suggest::nearest;

/// What follows the name of a directive.
struct Form {
    name: &'static str,
    texts: usize,
    numbers: usize,
    has_parameters: bool,
}

const fn form(name: &'static str, texts: usize, numbers: usize, has_parameters: bool) -> Form {
    Form { name, texts, numbers, has_parameters }
}

/// Every directive of pbrt-v4 and v3.
const DIRECTIVES: [Form; 42] = [
    form("Accelerator", 1, 0, true),
    form("ActiveTransform", 1, 0, false),
    form("AreaLightSource", 1, 0, true),
    form("Attribute", 1, 0, true),
    form("AttributeBegin", 0, 0, false),
    form("AttributeEnd", 0, 0, false),
    form("Camera", 1, 0, true),
    form("ColorSpace", 1, 0, false),
    form("ConcatTransform", 0, 16, false),
    form("CoordSysTransform", 1, 0, false),
    form("CoordinateSystem", 1, 0, false),
    form("Film", 1, 0, true),
    form("Identity", 0, 0, false),
    form("Import", 1, 0, false),
    form("Include", 1, 0, false),
    form("Integrator", 1, 0, true),
    form("LightSource", 1, 0, true),
    form("LookAt", 0, 9, false),
    form("MakeNamedMaterial", 1, 0, true),
    form("MakeNamedMedium", 1, 0, true),
    form("Material", 1, 0, true),
    form("MediumInterface", 1, 0, true),
    form("NamedMaterial", 1, 0, false),
    form("ObjectBegin", 1, 0, false),
    form("ObjectEnd", 0, 0, false),
    form("ObjectInstance", 1, 0, false),
    form("Option", 0, 0, true),
    form("PixelFilter", 1, 0, true),
    form("ReverseOrientation", 0, 0, false),
    form("Rotate", 0, 4, false),
    form("Sampler", 1, 0, true),
    form("Scale", 0, 3, false),
    form("Shape", 1, 0, true),
    form("SurfaceIntegrator", 1, 0, true),
    form("Texture", 3, 0, true),
    form("Transform", 0, 16, false),
    form("TransformBegin", 0, 0, false),
    form("TransformEnd", 0, 0, false),
    form("TransformTimes", 0, 2, false),
    form("Translate", 0, 3, false),
    form("WorldBegin", 0, 0, false),
    form("WorldEnd", 0, 0, false),
];

/// The values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers, or none at all.
    Numbers(Vec<f64>),
    /// Texts, and `true` and `false`.
    Texts(Vec<String>),
}

/// A parameter: `"float radius" 1`.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its type as v4 calls it.
    pub kind: String,
    /// Its name.
    pub name: String,
    /// Its values.
    pub values: Values,
    /// Its line.
    pub place: Place,
}

/// A directive.
#[derive(Debug)]
pub struct Statement {
    /// Its name.
    pub name: &'static str,
    /// Its line.
    pub place: Place,
    /// The texts that follow.
    pub texts: Vec<String>,
    /// The numbers that follow.
    pub numbers: Vec<f64>,
    /// The parameters that follow.
    pub parameters: Vec<Parameter>,
}

/// Reads one file's directives.
pub struct Parser<'t> {
    lexer: Lexer<'t>,
    file: Arc<Path>,
    ahead: Option<(Token<'t>, usize)>,
}

impl<'t> Parser<'t> {
    /// Before the first directive.
    pub fn new(text: &'t str, file: Arc<Path>) -> Self {
        Self { lexer: Lexer::new(text, file.clone()), file, ahead: None }
    }

    fn take(&mut self) -> Result<Option<(Token<'t>, usize)>, SceneError> {
        match self.ahead.take() {
            Some(token) => Ok(Some(token)),
            None => self.lexer.read(),
        }
    }

    fn peek(&mut self) -> Result<Option<&Token<'t>>, SceneError> {
        if self.ahead.is_none() {
            self.ahead = self.lexer.read()?;
        }
        Ok(self.ahead.as_ref().map(|(token, _)| token))
    }

    fn at(&self, line: usize) -> Place {
        Place { file: self.file.clone(), line }
    }

    /// The next directive, or nothing at the end.
    pub fn statement(&mut self) -> Result<Option<Statement>, SceneError> {
        let Some((token, line)) = self.take()? else { return Ok(None) };
        let place = self.at(line);
        let Token::Word(word) = token else {
            let found = describe(&token);
            return Err(place.error(format!("{found} stands where a directive should"), "begin with its name"));
        };
        let Some(form) = DIRECTIVES.iter().find(|form| form.name == word) else {
            let names = DIRECTIVES.map(|form| form.name);
            let mend = match nearest(word, &names) {
                Some(near) => format!("did you mean `{near}`?"),
                None => "give one such as `Shape`".to_string(),
            };
            return Err(place.error(format!("there is no directive `{}`", shown(word)), mend));
        };
        let mut statement = Statement {
            name: form.name,
            texts: Vec::with_capacity(form.texts),
            numbers: Vec::with_capacity(form.numbers),
            parameters: Vec::new(),
            place,
        };
        for _ in 0..form.texts {
            statement.texts.push(self.argument(&statement)?);
        }
        if form.name == "MediumInterface" && matches!(self.peek()?, Some(Token::Text(_))) {
            statement.texts.push(self.argument(&statement)?);
        }
        if form.numbers > 0 {
            self.numbers(form.numbers, &mut statement)?;
        }
        if form.name == "Option" {
            self.option(&statement)?;
        } else if form.has_parameters {
            while matches!(self.peek()?, Some(Token::Text(_))) {
                let parameter = self.parameter()?;
                statement.parameters.push(parameter);
            }
        }
        Ok(Some(statement))
    }

    /// A text after a directive's name, in brackets or not; of `ActiveTransform` a word.
    fn argument(&mut self, statement: &Statement) -> Result<String, SceneError> {
        let name = statement.name;
        let lacks = || statement.place.error(format!("`{name}` lacks a name"), "give one in quotation marks");
        let Some((token, _)) = self.take()? else { return Err(lacks()) };
        match token {
            Token::Text(text) => Ok(text.into_owned()),
            Token::Word(word) if name == "ActiveTransform" => Ok(word.to_string()),
            Token::Open => {
                let inner = self.take()?;
                let closed = self.take()?;
                match (inner, closed) {
                    (Some((Token::Text(text), _)), Some((Token::Close, _))) => Ok(text.into_owned()),
                    _ => Err(lacks()),
                }
            }
            _ => Err(lacks()),
        }
    }

    /// The name of an `Option`, which may lack its type, and its value; it changes no light.
    fn option(&mut self, statement: &Statement) -> Result<(), SceneError> {
        let lacks = |what: &str| {
            let message = format!("an `Option` lacks its {what}");
            Err(statement.place.error(message, "write one such as `Option \"seed\" 7`"))
        };
        let Some((Token::Text(_), _)) = self.take()? else { return lacks("name") };
        match self.take()? {
            Some((Token::Number(_) | Token::Text(_) | Token::Word("true" | "false"), _)) => Ok(()),
            Some((Token::Open, _)) => {
                while !matches!(self.peek()?, Some(Token::Close) | None) {
                    self.take()?;
                }
                self.take()?.map_or_else(|| lacks("end"), |_| Ok(()))
            }
            _ => lacks("value"),
        }
    }

    fn numbers(&mut self, count: usize, statement: &mut Statement) -> Result<(), SceneError> {
        let name = statement.name;
        let place = statement.place.clone();
        let wrong = |found: String| {
            place.error(format!("`{name}` has {found} where it needs {count} numbers"), format!("give {count} numbers"))
        };
        let in_brackets = matches!(self.peek()?, Some(Token::Open));
        if in_brackets {
            self.take()?;
        }
        for _ in 0..count {
            match self.take()? {
                Some((Token::Number(x), _)) => statement.numbers.push(x),
                Some((token, _)) => return Err(wrong(describe(&token))),
                None => return Err(wrong("an end".to_string())),
            }
        }
        if in_brackets && !matches!(self.take()?, Some((Token::Close, _))) {
            return Err(wrong("more".to_string()));
        }
        Ok(())
    }

    /// `"type name"` and a value, or several in brackets.
    fn parameter(&mut self) -> Result<Parameter, SceneError> {
        let Some((Token::Text(head), line)) = self.take()? else {
            return Err(self.lexer.place().error("a parameter has no name", "write `\"type name\" value`"));
        };
        let place = self.at(line);
        let mut words = head.split_whitespace();
        let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
            let message = format!("`{}` is no parameter", shown(&head));
            return Err(place.error(message, "give its type and its name, such as `\"float radius\"`"));
        };
        let kind = match kind {
            "color" => "rgb",
            "point" => "point3",
            "vector" => "vector3",
            "normal3" => "normal",
            "int" => "integer",
            "boolean" => "bool",
            other => other,
        };
        const KINDS: [&str; 15] = [
            "float",
            "integer",
            "bool",
            "string",
            "point2",
            "point3",
            "vector2",
            "vector3",
            "normal",
            "rgb",
            "xyz",
            "spectrum",
            "blackbody",
            "texture",
            "filename",
        ];
        if !KINDS.contains(&kind) {
            let near =
                nearest(kind, &KINDS).map_or_else(|| "write `float`".to_string(), |n| format!("did you mean `{n}`?"));
            return Err(place.error(format!("`{}` has no type that is known", shown(&head)), near));
        }
        let (kind, name) = (kind.to_string(), name.to_string());
        let (mut numbers, mut texts) = (Vec::new(), Vec::new());
        let unfinished = || place.error(format!("the parameter `{name}` has no end"), "close its list by `]`");
        let mut single = true;
        loop {
            let Some((token, line)) = self.take()? else { return Err(unfinished()) };
            match token {
                Token::Number(x) => numbers.push(x),
                Token::Text(text) => texts.push(text.into_owned()),
                Token::Word(word @ ("true" | "false")) => texts.push(word.to_string()),
                Token::Open if single && numbers.is_empty() && texts.is_empty() => {
                    single = false;
                    continue;
                }
                Token::Close if !single => break,
                token => {
                    let message = format!("{} stands where a value of `{name}` should", describe(&token));
                    return Err(self.at(line).error(message, "give numbers or texts"));
                }
            }
            if !numbers.is_empty() && !texts.is_empty() {
                let message = format!("`{name}` has numbers and texts");
                return Err(self.at(line).error(message, "give one of the two"));
            }
            if single {
                break;
            }
        }
        let values = if texts.is_empty() { Values::Numbers(numbers) } else { Values::Texts(texts) };
        Ok(Parameter { kind, name, values, place })
    }
}

fn describe(token: &Token) -> String {
    match token {
        Token::Word(word) => format!("`{}`", shown(word)),
        Token::Text(text) => format!("the text `{}`", shown(text)),
        Token::Number(x) => format!("the number {x}"),
        Token::Open => "`[`".to_string(),
        Token::Close => "`]`".to_string(),
    }
}
