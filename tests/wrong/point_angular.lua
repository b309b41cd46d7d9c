-- expect: 8: points.E.angular: a number; must be true or false
-- expect: 9: points.F.angula: unknown field; did you mean "angular"?
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = { { "a", joint = "x", mass = 1 } },
  points = {
    E = { on = "a", angular = 1 },
    F = { on = "a", angula = true },
  },
}
