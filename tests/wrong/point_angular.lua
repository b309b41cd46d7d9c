-- expect: 8: points.E.angular: a number, true or false is needed
-- expect: 9: points.F.angula: unknown field, the nearest known one is "angular"
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = { { "a", joint = "x", mass = 1 } },
  points = {
    E = { on = "a", angular = 1 },
    F = { on = "a", angula = true },
  },
}
