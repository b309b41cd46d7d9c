-- Forces that balance at rest, where no rate shows their size: a motor and a spring hold a link level;
-- or two sliders, each pressed by a force that its own force cancels at q = 0.
local rd = require "refdyn"
local which = rd.option("which", "link", { "link", "sliders" })
local p = rd.parameters { { "m", 2, "kg" }, { "k", 2e4, "N m/rad" }, { "F", 300, "N" } }

if which == "link" then
  rd.input("torque", 0, "N m")
  return rd.model {
    name = "preload", gravity = { 0, 0, -9.81 },
    links = { { "link", turn = { { "x", rd.pi / 2 } }, joint = "psi", spring = { psi = p.k } },
              { "mass", on = "link", at = { 0.8, 0, 0 }, mass = p.m } },
    forces = function(s) return { link_psi = s.inputs.torque } end,
  }
end
return rd.model {
  name = "preload",
  links = { { "first", joint = "x", mass = p.m }, { "second", joint = "y", mass = 0.7 } },
  forces = function(s)
    return { first_x = p.F * rd.cos(s.q.first_x + 0.3) - p.F * rd.cos(0.3),
             second_y = 2 * p.F * rd.cos(s.q.second_y + 0.4) - 2 * p.F * rd.cos(0.4) }
  end,
}
