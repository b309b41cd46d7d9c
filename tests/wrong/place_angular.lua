-- expect: 8: constraints[1].a.angular: allowed for points of interest only; remove it
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = { { "a", joint = "x", mass = 1 } },
  constraints = function(s)
    return {
      rd.loop { { on = "a", angular = true }, "ground", keep = "x" },
    }
  end,
}
