-- expect: 3: parameter m: value nan; must be finite
local rd = require "refdyn"
local p = rd.parameters { { "m", 0/0, "kg" } }
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
