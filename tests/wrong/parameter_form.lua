-- expect: 7: parameter m: a text, a number or an expression is needed
-- expect: 8: parameters[2]: not of that form, { "name", value, "unit" } is needed
-- expect: 9: parameters.k: a named entry, { "k", value, "unit" } is needed
-- expect: 10: parameters[3]: not of that form, { "name", value, "unit" } is needed
local rd = require "refdyn"
local p = rd.parameters {
  { "m", "kg" },
  { 1, "kg" },
  k = 3,
  { "c", 1, "kg", 4 },
}
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
