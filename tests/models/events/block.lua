-- A slender block that rocks about its two edges (Housner, Bull. Seism. Soc. Am. 53:403-417, 1963): the input
-- `side` says about which one; an impact reduces the rate and changes the side.
local rd = require "refdyn"
local p = rd.parameters { { "p", 2, "rad/s" }, { "alpha", 0.2, "rad" }, { "keep", 0.9 }, { "start", 0.15, "rad" } }
local side = rd.input("side", 1)
return rd.model {
  name = "block",
  links = { { "block", joint = "psi", mass = 1, inertia = { zz = 2 }, start = { psi = p.start } } },
  forces = function(s) return { block_psi = 2 * p.p ^ 2 * (s.q.block_psi - side * p.alpha) } end,
  events = function(s)
    return { rd.event { s.q.block_psi, rates = { block_psi = p.keep * s.qd.block_psi }, inputs = { side = -side }, name = "impact" } }
  end,
}
