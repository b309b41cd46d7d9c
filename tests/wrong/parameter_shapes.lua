-- expect: 8: item 5 of a list is nil, lists have no gaps
-- expect: 9: parameter m: a text, a number or an expression is needed
-- expect: 10: parameters[2]: not of that form, { "name", value, "unit" } is needed
-- expect: 11: parameters[3]: not of that form, { "name", value, "unit" } is needed
-- expect: 12: parameters[4]: not of that form, { "name", value, "unit" } is needed
-- expect: 14: parameter e: value nan, a finite number is needed
local rd = require "refdyn"
local p = rd.parameters {
  { "m", "1" },
  { "k" },
  { "c", 1, unit = "kg" },
  { "d", 1, 2 },
  nil,
  { "e", 0 / 0 },
}
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = p.m },
    { "b", joint = "z", mass = p.k },
    { "c", joint = "z", mass = p.c },
    { "d", joint = "z", mass = p.d },
    { "e", joint = "z", mass = p.unit },
  },
}
