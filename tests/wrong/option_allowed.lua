-- expect: 13: option a: allowed: unknown field "min", { from = 1, to = 9 } is needed
-- expect: 14: option b: allowed: unknown field "form", the nearest known one is "from", { from = 1, to = 9 } is needed
-- expect: 15: option c: allowed: both a list of values and a range, one of them is needed
-- expect: 16: option d: allowed: nothing, a list of values or { from = 1, to = 9 } is needed
-- expect: 17: option e: allowed: from 9 to 1, a range that ascends is needed
-- expect: 18: option f: allowed: from or to is no number, { from = 1, to = 9 } is needed
-- expect: 19: option g: allowed: from or to, for a text a list of values is needed
-- expect: 20: option h: allowed: value 2 is a number, a text as the default is needed
-- expect: 21: option i: allowed: "x" is there twice, once is enough
-- expect: 22: option j: value inf, a finite number is needed
-- expect: 23: option k: allowed: value 2 is a text, true or false as the default is needed
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
