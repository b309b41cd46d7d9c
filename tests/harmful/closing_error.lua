-- expect: 6: deep
-- Tries to keep Lua busy while an error unwinds 150,000 calls.
local rd = require "refdyn"
local function deep(n)
  local x <close> = nil
  if n == 0 then error("deep") end
  deep(n - 1)
  return n
end
deep(150000)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
