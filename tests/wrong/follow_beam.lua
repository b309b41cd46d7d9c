-- expect: 9: links[1].bem: unknown field; did you mean "beam"?
-- expect: 11: links[3].beam: a number; must be a beam such as { length = 1, section = rd.round(0.014), ... }
-- expect: 13: links[5].beam.lenght: unknown field; did you mean "length"?
-- expect: 14: links[6].beam.sektion: unknown field; did you mean "section"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", bem = { length = 1, section = rd.round(0.014), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4 } },
    { "b", on = "a.tip", joint = "z", mass = 1 },
    { "c", joint = "z", beam = 5 },
    { "d", on = "c", along = 0.5, joint = "z", mass = 1 },
    { "e", joint = "z", beam = { lenght = 1, section = rd.round(0.014), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4 } },
    { "f", joint = "z", beam = { length = 1, sektion = rd.round(0.014), E = 2.1e11, nu = 0.3, rho = 7800, rfe = 4 } },
  },
}
