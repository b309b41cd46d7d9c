-- expect: 3: pairs: number, a table is needed
local rd = require "refdyn"
for name in pairs(12) do end
