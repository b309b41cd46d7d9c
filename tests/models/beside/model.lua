-- A model with parts from another file. By hand: M = 2 (1 + 0.05^2) / 12 + 2 0.5^2 = 0.66708333 kg m^2.
local rd = require "refdyn"
local parts = require "parts"

return rd.model {
  name = "beside", gravity = { 0, 0, -9.81 },
  links = { { "arm", joint = "theta", bodies = { parts.bar(1, 2) } } },
}
