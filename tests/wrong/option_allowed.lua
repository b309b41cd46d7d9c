-- expect: 13: option a: allowed: unknown field "min"; use one of from, to
-- expect: 14: option b: allowed: unknown field "form"; did you mean "from"?
-- expect: 15: option c: allowed: a list of values and a range; give one of them
-- expect: 16: option d: allowed: empty; must be a list of values or { from = 1, to = 9 }
-- expect: 17: option e: allowed: from 9 to 1; the range must ascend
-- expect: 18: option f: allowed: from or to is not a number; write { from = 1, to = 9 }
-- expect: 19: option g: allowed: a range, but the default is a text; must be a list of values
-- expect: 20: option h: allowed: value 2 is a number; must be a text, as the default is
-- expect: 21: option i: allowed: "x" is given twice; give it once
-- expect: 22: option j: value inf; must be finite
-- expect: 23: option k: allowed: value 2 is a text; must be a truth value, as the default is
local rd = require "refdyn"
rd.option("a", 5, { min = 1 })
rd.option("b", 5, { form = 1, to = 9 })
rd.option("c", 5, { 4, 5, from = 1 })
rd.option("d", 5, {})
rd.option("e", 5, { from = 9, to = 1 })
rd.option("f", 5, { from = "1" })
rd.option("g", "x", { from = 1 })
rd.option("h", "x", { "x", 5 })
rd.option("i", "x", { "x", "y", "x" })
rd.option("j", 1 / 0)
rd.option("k", true, { true, "false" })
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
}
