-- expect: 3: pairs: number; must be a table
local rd = require "refdyn"
for name in pairs(12) do end
