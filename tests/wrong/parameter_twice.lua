-- expect: 5: parameter m: the name is taken by line 4, each parameter needs its own
local rd = require "refdyn"
local p = rd.parameters {
  { "m", 1, "kg" },
  { "m", 2, "kg" },
}
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
